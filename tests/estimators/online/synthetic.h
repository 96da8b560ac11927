#pragma once
// Samples of a motor whose operating point is known exactly: three phase voltages and currents with
// harmonics, sensor zeros, noise and 12-bit converters, the voltage behind a first-order filter in its steady
// state, an encoder that rounds down. Analytic; shares nothing with the estimator.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

#include "estimators/online/operating_point.h"

namespace imrig::est {

struct Signal {
  double f_Hz = 50.0;  // negative: phase order a-c-b
  double V = 150.0;    // peak, before the filter
  double I = 10.0;     // peak
  double phi_rad = 0.6;
  double speed_rpm = 1450.0;
  double harmonic5 = 0.0, harmonic7 = 0.0;  // of V, each in its natural sequence; a tenth of it in I
  double v_zero_V = 0.0, i_zero_A = 0.0;    // phase a's; b has minus half of it, c none
  double v_noise_V = 0.0, i_noise_A = 0.0;  // one sigma per phase and sample
  double filter_s = 0.0;
  double v_scale = 0.1, i_scale = 0.01;  // per count
  double sample_time_s = 60e-6;
  int counts_per_rev = 4096;
  std::uint64_t seed = 1;
  // Angle of the fundamental in rad over t; for ramps. Default: 2 pi f t.
  std::function<double(double)> angle;
  std::function<double(double)> amplitude;  // of V, over t; default 1
};

struct Samples {
  std::vector<std::int16_t> i[3], v[3];
  std::vector<std::int32_t> encoder;
};

inline Samples make_samples(const Signal& s, std::size_t n, std::size_t first = 0) {
  constexpr double kThird = 2.0 * std::numbers::pi / 3.0;
  std::mt19937_64 random(s.seed);
  std::normal_distribution<double> normal;
  const double w = 2.0 * std::numbers::pi * s.f_Hz;
  const double v_zero[] = {s.v_zero_V, -0.5 * s.v_zero_V, 0.0},
               i_zero[] = {s.i_zero_A, -0.5 * s.i_zero_A, 0.0};
  const auto filtered = [&](double order,
                            double phase) {  // cos(phase) behind the filter; order carries the sense
    const double x = std::abs(order * w * s.filter_s);
    return std::cos(phase - std::atan(x)) / std::sqrt(1.0 + x * x);
  };
  const auto counts = [](double value, double scale) {
    return static_cast<std::int16_t>(std::clamp(std::lround(value / scale), -32768L, 32767L));
  };
  Samples out;
  for (std::size_t k = first; k < first + n; ++k) {
    const double t = static_cast<double>(k) * s.sample_time_s;
    const double theta = s.angle ? s.angle(t) : std::abs(w) * t;
    const double gain = s.amplitude ? s.amplitude(t) : 1.0;
    for (int p = 0; p < 3; ++p) {
      const double shift = (s.f_Hz < 0.0 ? -p : p) * kThird;
      const double v = gain * s.V *
                       (filtered(1, theta - shift) + s.harmonic5 * filtered(5, 5 * (theta - shift) + 0.3) +
                        s.harmonic7 * filtered(7, 7 * (theta - shift) - 0.7));
      const double i =
          gain * s.I *
          (std::cos(theta - shift - s.phi_rad) + 0.1 * s.harmonic5 * std::cos(5 * (theta - shift) - 1.0) +
           0.1 * s.harmonic7 * std::cos(7 * (theta - shift) + 2.0));
      out.v[p].push_back(counts(v + v_zero[p] + s.v_noise_V * normal(random), s.v_scale));
      out.i[p].push_back(counts(i + i_zero[p] + s.i_noise_A * normal(random), s.i_scale));
    }
    const double turns = s.speed_rpm / 60.0 * t;
    const auto count = static_cast<std::int64_t>(std::floor(turns * s.counts_per_rev));
    out.encoder.push_back(static_cast<std::int32_t>(static_cast<std::uint32_t>(count)));
  }
  return out;
}

inline SampleBlock block_of(const Signal& s, const Samples& x, std::size_t from, std::size_t n,
                            std::int64_t first_index) {
  SampleBlock b;
  b.boot_id = 77;
  b.first_index = first_index;
  b.sample_time_ns = std::llround(1e9 * s.sample_time_s);
  b.gates_on = true;
  b.current_A_per_count = s.i_scale;
  b.voltage_V_per_count = s.v_scale;
  b.voltage_filter_s = s.filter_s;
  b.encoder_counts_per_rev = s.counts_per_rev;
  const auto cut = [&](const auto& all) { return std::span(all).subspan(from, n); };
  b.i_a = cut(x.i[0]);
  b.i_b = cut(x.i[1]);
  b.i_c = cut(x.i[2]);
  b.v_a = cut(x.v[0]);
  b.v_b = cut(x.v[1]);
  b.v_c = cut(x.v[2]);
  b.encoder = cut(x.encoder);
  return b;
}

// All samples as one stream of blocks of the given length.
inline std::vector<OperatingPoint> estimate(const Signal& s, double seconds, std::size_t block = 256,
                                            const OperatingPointConfig& config = {}) {
  std::vector<OperatingPoint> points;
  OperatingPointEstimator estimator(config, [&](const OperatingPoint& p) { points.push_back(p); });
  const auto n = static_cast<std::size_t>(seconds / s.sample_time_s);
  const Samples x = make_samples(s, n);
  for (std::size_t at = 0; at < n; at += block) {
    estimator.feed(block_of(s, x, at, std::min(block, n - at), static_cast<std::int64_t>(at)));
  }
  return points;
}

}  // namespace imrig::est
