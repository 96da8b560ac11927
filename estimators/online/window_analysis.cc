#include "estimators/online/window_analysis.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimators/online/count_slope.h"
#include "estimators/online/held_voltage.h"
#include "estimators/online/tone.h"
#include "rig/base/space_vector.h"

namespace imrig::est {

namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kNearlyWhole =
    0.02;                            // of a period: a buffer that just misses its last period still holds it
constexpr double kLeastShare = 0.5;  // of the voltage's mean square, for a fundamental

double rms(std::span<const SpaceVector> x) {
  double sum = 0.0;
  for (const SpaceVector& v : x) sum += std::norm(v);
  return std::sqrt(sum / static_cast<double>(x.size()));
}

double mean_power_W(std::span<const SpaceVector> v, std::span<const SpaceVector> i) {
  double sum = 0.0;
  for (std::size_t k = 0; k < v.size(); ++k) sum += power_W(v[k], i[k]);
  return sum / static_cast<double>(v.size());
}

std::size_t samples_of(double periods, double w, std::size_t most) {
  return std::min(static_cast<std::size_t>(std::lround(2.0 * kPi * periods / std::abs(w))), most);
}

}  // namespace

std::optional<WindowFrequency> find_frequency(std::span<const SpaceVector> v, double least_V) {
  const double amplitude = rms(v);
  if (!(amplitude >= least_V)) return std::nullopt;
  const std::optional<double> rough = crossing_frequency(v, amplitude);
  if (!rough || std::abs(*rough) >= 1.0)
    return std::nullopt;  // more than 6 samples a period, else it is no sampling
  const double held = std::abs(*rough) * static_cast<double>(v.size()) / (2.0 * kPi);
  const double periods = std::floor(held + kNearlyWhole);
  if (periods < kLeastPeriods) return std::nullopt;
  const std::optional<double> w =
      phase_slope_frequency(v.first(samples_of(periods, *rough, v.size())), *rough);
  if (!w) return std::nullopt;
  return WindowFrequency{*w, samples_of(periods, *w, v.size())};
}

bool analyse_electrical(const WindowBuffer& window, const WindowFrequency& frequency,
                        const WindowFacts& facts, OperatingPoint& out) {
  const auto v = window.v().first(frequency.samples);
  const auto i = window.i().first(frequency.samples);
  const Tone volts = fit_tone(v, frequency.rad_per_sample);
  const Tone amps = fit_tone(i, frequency.rad_per_sample);
  const double total = rms(v);
  if (std::norm(volts.positive) < kLeastShare * total * total) return false;

  const double w_rad_s = frequency.rad_per_sample / facts.sample_time_s;
  const SpaceVector V =
      volts.positive * (facts.voltage_held
                            ? held_voltage(frequency.rad_per_sample, facts.sample_time_s, facts.voltage_filter_s)
                            : SpaceVector(1.0, w_rad_s * facts.voltage_filter_s));
  const SpaceVector I = amps.positive + ripple_share(V, w_rad_s, facts.sample_time_s, facts.leakage_H);
  out.voltage_zero_V = volts.zero;
  out.current_zero_A = amps.zero;
  const double root_n = std::sqrt(static_cast<double>(frequency.samples));
  out.frequency_Hz = w_rad_s / (2.0 * kPi);
  out.voltage_V = std::abs(V);
  out.current_A = std::abs(I);
  // With the other phase order the vectors turn the other way: what is ahead in time is behind in angle.
  const double ahead = std::arg(V * std::conj(I));
  out.phi_rad = frequency.rad_per_sample > 0.0 ? ahead : -ahead;
  out.input_power_W =
      mean_power_W(v, i) - power_W(volts.zero, amps.zero) + power_W(V, I) -
      power_W(volts.positive, amps.positive);
  const double per_sample = frequency_sigma(std::abs(volts.positive), volts.residual_rms, frequency.samples);
  out.sigma_frequency_Hz = per_sample / (2.0 * kPi * facts.sample_time_s);
  out.sigma_voltage_V = volts.residual_rms / (std::numbers::sqrt2 * root_n);
  out.sigma_current_A = amps.residual_rms / (std::numbers::sqrt2 * root_n);
  return true;
}

void analyse_speed(const WindowBuffer& window, std::size_t n, const WindowFacts& facts, OperatingPoint& out) {
  out.speed_rpm = out.slip = kNone;
  if (facts.encoder_counts_per_rev < 1 || n < 2) return;
  const CountSlope slope = fit_count_slope(window.counts().first(n));
  const double rpm_per_count = 60.0 / (facts.encoder_counts_per_rev * facts.sample_time_s);
  out.speed_rpm = slope.per_sample * rpm_per_count;
  if (!out.valid) return;
  const double synchronous_rpm = 60.0 * out.frequency_Hz / facts.pole_pairs;
  out.slip = 1.0 - out.speed_rpm / synchronous_rpm;
  const double from_speed = slope.sigma * rpm_per_count / synchronous_rpm;
  const double from_frequency = (1.0 - out.slip) * out.sigma_frequency_Hz / out.frequency_Hz;
  out.sigma_slip = std::hypot(from_speed, from_frequency);
}

}  // namespace imrig::est
