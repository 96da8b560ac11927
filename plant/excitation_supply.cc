#include "plant/excitation_supply.h"

#include <algorithm>
#include <cmath>

namespace imrig::plant {
namespace {

double sane(double value, double most) { return std::isfinite(value) ? std::clamp(value, 0.0, most) : 0.0; }

bool passed(double value, double level) { return std::isfinite(level) && level > 0.0 && value > level; }

}  // namespace

void ExcitationSupply::set(const ExcitationCommand& command) {
  command_ = command;
  command_.set_V = sane(command.set_V, config_.max_V);
  command_.set_A = sane(command.set_A, config_.max_A);
  if (!command_.output_on) readback_.tripped_ovp = readback_.tripped_ocp = false;
}

void ExcitationSupply::protect(double field_A) {
  readback_.tripped_ovp = passed(V_, command_.ovp_V);
  readback_.tripped_ocp = !readback_.tripped_ovp && passed(field_A, command_.ocp_A);
}

double ExcitationSupply::regulated(double field_A, double period_s) {
  const double most = config_.slew_V_per_s * period_s;
  ramped_V_ += std::clamp(command_.set_V - ramped_V_, -most, most);
  const double error_A = command_.set_A - field_A;
  const double wanted = config_.kp_V_per_A * error_A + integral_V_;
  readback_.constant_current = wanted < ramped_V_;
  if (readback_.constant_current) {
    integral_V_ = std::clamp(integral_V_ + config_.ki_V_per_As * error_A * period_s, 0.0, config_.max_V);
  }
  return std::clamp(wanted, 0.0, ramped_V_);
}

double ExcitationSupply::update(double field_A, double period_s) {
  if (command_.output_on && !tripped()) {
    V_ = regulated(field_A, period_s);
    protect(field_A);
  }
  readback_.output_on = command_.output_on && !tripped();
  if (!readback_.output_on) {
    V_ = ramped_V_ = integral_V_ = 0.0;
    readback_.constant_current = false;
  }
  readback_.V = V_;
  readback_.A = readback_.output_on ? field_A : 0.0;
  return V_;
}

}  // namespace imrig::plant
