#include "estimators/online/standing_motor.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace imrig::est {

namespace {

// At first the noise has to hold the error of a start that is 30 % off, too: with less the filter believes its
// first, wrong slopes.
constexpr double kDoubting_A = 0.2, kBelieving_A = 0.03, kDoubting_s = 3.0;
constexpr double kNoise_A = 0.03;  // behind the filter: changes below are none

JointFilterConfig wide(const MotorKnowledge& motor) {
  JointFilterConfig c;
  c.start = motor.base;
  c.sigma = {0.3, 0.3, 0.3, 0.3};
  c.voltage_noise_V = 0.3;
  return c;
}

}  // namespace

StandingMotor::StandingMotor(const MotorKnowledge& motor) : filter_(wide(motor)), decay_(std::exp(-kWindow_s * motor.base.R_r / motor.base.L_m)) {}

void StandingMotor::interrupt() {
  running_ = false;
  kind_ = Kind::kNone;
  sums_ = {};
  forget_level();
}

void StandingMotor::forget_level() {
  last_seen_ = sum_ = 0.0;
  windows_ = 0;
}

std::optional<StandingMotor::Resistance> StandingMotor::take(std::complex<double> v, std::complex<double> i, double h, std::int64_t index) {
  if (!running_) {
    filter_.reset(0.01);
    filter_.set_current_noise(kDoubting_A);
    tones_s_ = 0.0;
  }
  running_ = true;
  filter_.take(v, i, 0.0, h);
  sums_.power += (v * std::conj(i)).real();
  sums_.square += std::norm(i);
  sums_.i += i;
  sums_.n += 1.0;
  if (kind_ == Kind::kTones) {
    tones_s_ += h;
    if (tones_s_ > kDoubting_s) filter_.set_current_noise(kBelieving_A);
    tones_index_ = index;
  }
  return sums_.n * h >= kWindow_s ? close() : std::nullopt;
}

std::optional<StandingMotor::Resistance> StandingMotor::close() {
  const Sums s = sums_;
  sums_ = {};
  const double mean = std::norm(s.i / s.n), square = s.square / s.n;
  if (!(square > kLeast_A * kLeast_A)) return std::nullopt;
  const double most = std::max(kChanging * std::sqrt(square), kNoise_A);
  if (square - mean > most * most) {
    // What is neither constant nor alternating is a direct current on its way.
    kind_ = square - mean > kAlternating * kAlternating * square ? Kind::kTones : Kind::kNone;
    forget_level();
    return std::nullopt;
  }
  kind_ = Kind::kDirect;
  tones_s_ = 0.0;
  const double seen = s.power / s.square, before = std::exchange(last_seen_, seen);
  if (before == 0.0) return std::nullopt;
  const double R_s = (seen - decay_ * before) / (1.0 - decay_), tail = std::abs(seen / R_s - 1.0);
  if (!(R_s > 0.0 && tail < kMostTail)) return std::nullopt;
  sum_ += R_s;
  if (++windows_ < 2) return std::nullopt;
  return Resistance{sum_ / windows_, std::hypot(kWindowSigma / std::sqrt(windows_), kDecayDoubt * tail)};
}

}  // namespace imrig::est
