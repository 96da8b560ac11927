#pragma once
// Single lines of a space vector's spectrum, and the T circuit of bench.h at one frequency.

#include <cmath>
#include <complex>

#include "tests/plant/bench.h"

namespace imrig::plant::bench {

// Mean of x exp(-j 2 pi f t) under a Hann window over n samples; exact for whole periods.
class Line {
 public:
  Line(double f_Hz, double step_s, int n) : f_Hz_(f_Hz), step_s_(step_s), n_(n) {}
  void add(Complex x) {
    const double weight = 1.0 - std::cos(2.0 * kPi * (k_ + 0.5) / n_);
    sum_ += weight / n_ * x * std::polar(1.0, -2.0 * kPi * f_Hz_ * step_s_ * k_);
    ++k_;
  }
  double amplitude() const { return std::abs(sum_); }

 private:
  double f_Hz_, step_s_;
  int n_, k_ = 0;
  Complex sum_ = 0.0;
};

inline constexpr double kL = kLl + kLm;        // H, stator and rotor
inline const double kM = std::sqrt(kLm * kL);  // H
inline const double kRrT = kRr * kL / kLm;     // ohm
inline constexpr Complex kJ{0.0, 1.0};

inline Complex motor_impedance(double R_s, double w, double slip) {
  return R_s + kJ * w * kL + slip * w * w * kM * kM / (kRrT + kJ * slip * w * kL);
}

// The motor on a drive that holds its speed; fixed steps of 60 us.
inline PlantConfig held_speed(double rpm) {
  PlantConfig c = config();
  c.integrator.kind = IntegratorConfig::Kind::kRk4;
  c.generator.coupled = false;
  c.mechanics.held_speed_rpm = rpm;
  return c;
}

}  // namespace imrig::plant::bench
