#pragma once
// Samples of a motor in steady state from its phasor circuit: R_s + jX_l, then jX_m, R_r/s and R_c side by
// side. The voltage channel passes a first-order filter in its own steady state. Shares nothing with the
// observer.

#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <random>

namespace imrig::est::phasor {

struct Motor {
  double R_s = 0.39, R_r = 0.22, L_l = 0.006, L_m = 0.068;
  double R_c = std::numeric_limits<double>::infinity();
  int pole_pairs = 2;
};

inline std::complex<double> impedance(const Motor& m, double w, double slip) {
  const std::complex<double> rotor =
      1.0 / (1.0 / std::complex<double>(0.0, w * m.L_m) + slip / m.R_r + 1.0 / m.R_c);
  return std::complex<double>(m.R_s, w * m.L_l) + rotor;
}

struct Point {
  double f_Hz = 60.0;
  double slip = 0.03;
  double V = 150.0;
  bool reversed = false;  // phase order a-c-b
};

struct Channels {
  double filter_s = 160e-6;
  double v_noise_V = 0.0, i_noise_A = 0.0;
  double v_zero_V = 0.0, i_zero_A = 0.0;
};

struct Sample {
  std::complex<double> v, i;
  double speed_rad_s = 0.0;
};

// The sample at t seconds; calls for one generator follow each other in time.
class Source {
 public:
  Source(const Motor& motor, const Channels& channels, std::uint64_t seed)
      : motor_(motor), channels_(channels), random_(seed) {}
  Sample at(const Point& p, double t) {
    const double w = 2.0 * std::numbers::pi * p.f_Hz;
    const std::complex<double> turn = std::polar(1.0, w * t + 0.3);
    const std::complex<double> i = p.V / impedance(motor_, w, p.slip) * turn;
    const std::complex<double> v = p.V * turn / std::complex<double>(1.0, w * channels_.filter_s);
    Sample s;
    s.v = (p.reversed ? std::conj(v) : v) + channels_.v_zero_V + noise(channels_.v_noise_V);
    s.i = (p.reversed ? std::conj(i) : i) + channels_.i_zero_A + noise(channels_.i_noise_A);
    s.speed_rad_s = (p.reversed ? -1.0 : 1.0) * w * (1.0 - p.slip) / motor_.pole_pairs;
    return s;
  }
  Motor& motor() { return motor_; }

 private:
  std::complex<double> noise(double sigma) { return {sigma * normal_(random_), sigma * normal_(random_)}; }
  Motor motor_;
  Channels channels_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
};

}  // namespace imrig::est::phasor
