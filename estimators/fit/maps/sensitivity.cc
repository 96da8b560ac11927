#include "estimators/fit/maps/sensitivity.h"

#include <cmath>

#include "estimators/model/steady_state.h"

namespace imrig::est {

namespace {

constexpr double kStep = 0.1;
constexpr int kSlips = 101;

std::complex<double> current(const MachineParameters<double>& m, double w_e, double slip) {
  return plain(steady_state(m, 1, 1.0, w_e, (1.0 - slip) * w_e).i_s);
}

double one(const MachineParameters<double>& m, double MachineParameters<double>::*y, double w_e, double slip) {
  MachineParameters<double> off = m;
  off.*y *= 1.0 + kStep;
  const std::complex<double> I = current(m, w_e, slip);
  return 0.5 * std::norm(current(off, w_e, slip) - I) / std::norm(I) / kStep;
}

}  // namespace

double Sensitivity::of(const std::string& parameter) const {
  return parameter == "R_r" ? R_r : parameter == "L_l" ? L_l : parameter == "L_m" ? L_m : 1.0;
}

Sensitivity sensitivity_at(const MachineParameters<double>& m, double w_e, double slip) {
  using P = MachineParameters<double>;
  return {one(m, &P::R_r, w_e, slip), one(m, &P::L_l, w_e, slip), one(m, &P::L_m, w_e, slip)};
}

SensitivityCurve sensitivity_curve(const MachineParameters<double>& m, double f_Hz) {
  SensitivityCurve curve;
  curve.f_Hz = f_Hz;
  for (int k = 0; k < kSlips; ++k) {
    const double slip = 0.1 * k / (kSlips - 1);
    curve.slip.push_back(slip);
    curve.value.push_back(sensitivity_at(m, 6.283185307179586 * f_Hz, slip));
  }
  return curve;
}

}  // namespace imrig::est
