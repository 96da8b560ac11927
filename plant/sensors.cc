#include "plant/sensors.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

#include "rig/base/space_vector.h"

namespace imrig::plant {
namespace {

// The streams must not run along each other.
constexpr std::uint64_t kNoiseStream = 0x9e3779b97f4a7c15ull;
constexpr std::uint64_t kMissingStream = 0xbf58476d1ce4e5b9ull;
constexpr std::int64_t kMostPerSample = 1 << 20;  // lines

// A seed stands for one bench: whatever makes the noise, its gains and offsets stay. Marsaglia's polar method
// on std::mt19937_64, whose bits the standard fixes; two draws a pair.
class Gauges {
 public:
  explicit Gauges(std::uint64_t seed) : bits_(seed) {}
  double normal() {
    if (std::exchange(spare_ready_, !spare_ready_)) return spare_;
    double x, y, square;
    do {
      x = uniform();
      y = uniform();
      square = x * x + y * y;
    } while (square >= 1.0 || square == 0.0);
    const double factor = std::sqrt(-2.0 * std::log(square) / square);
    spare_ = y * factor;
    return x * factor;
  }

 private:
  double uniform() { return static_cast<double>(bits_() >> 11) * 0x1p-52 - 1.0; }  // [-1, 1)

  std::mt19937_64 bits_;
  double spare_ = 0.0;
  bool spare_ready_ = false;
};

}  // namespace

SensorScale sensor_scale(const SensorsConfig& config) {
  const int full_scale = 1 << ((config.ideal ? 16 : config.adc_bits) - 1);
  return {config.current_range_A / full_scale, config.voltage_range_V / full_scale, config.voltage_filter_s,
          full_scale, config.encoder_counts_per_rev};
}

SensorErrors draw_sensor_errors(const SensorsConfig& config, std::uint64_t seed) {
  SensorErrors errors;
  if (config.ideal) return errors;
  Gauges noise(seed);
  for (auto* gains : {&errors.current_gain, &errors.voltage_gain}) {
    for (double& gain : *gains) gain = config.gain_sigma * noise.normal();
  }
  for (auto* offsets : {&errors.current_offset_counts, &errors.voltage_offset_counts}) {
    for (double& offset : *offsets) offset = config.offset_sigma_counts * noise.normal();
  }
  return errors;
}

Sensors::Sensors(const SensorsConfig& config, std::uint64_t seed)
    : config_(config),
      scale_(sensor_scale(config)),
      errors_(draw_sensor_errors(config, seed)),
      noise_(seed ^ kNoiseStream),
      missing_(seed ^ kMissingStream) {
  if (config_.ideal) config_.current_noise_A = config_.voltage_noise_V = 0.0;
}

std::int16_t Sensors::convert(double value, double gain, double offset_counts, double noise,
                              double per_count) {
  const double full = scale_.full_scale_counts;
  const double noisy = noise > 0.0 ? value * (1.0 + gain) + noise * noise_.normal() : value * (1.0 + gain);
  return static_cast<std::int16_t>(
      std::lrint(std::clamp(noisy / per_count + offset_counts, -full, full - 1.0)));
}

std::int64_t Sensors::count(std::int64_t lines) {
  if (config_.encoder_loss <= 0.0) return lines;
  if (first_) seen_ = counted_ = lines;
  first_ = false;
  const std::int64_t moved = std::clamp(lines - seen_, -kMostPerSample, kMostPerSample);
  const std::int64_t sign = moved < 0 ? -1 : 1;
  for (std::int64_t k = 0; k < moved * sign; ++k) {
    const bool missed = missing_.uniform() < config_.encoder_loss;
    counted_ += missed ? 0 : sign;
  }
  seen_ = lines;
  return counted_;
}

RawSample Sensors::sample(const Measured& values, std::int64_t turns) {
  RawSample raw;
  for (std::size_t k = 0; k < 3; ++k) {
    raw.i[k] = convert(values.i[k], errors_.current_gain[k], errors_.current_offset_counts[k],
                       config_.current_noise_A, scale_.current_A_per_count);
  }
  for (std::size_t k = 0; k < 3; ++k) {
    raw.v[k] = convert(values.v[k], errors_.voltage_gain[k], errors_.voltage_offset_counts[k],
                       config_.voltage_noise_V, scale_.voltage_V_per_count);
  }
  const auto lines =
      static_cast<std::int64_t>(std::floor(values.encoder_rad / (2.0 * kPi) * scale_.encoder_counts_per_rev));
  raw.encoder = static_cast<std::int32_t>(
      static_cast<std::uint32_t>(count(turns * scale_.encoder_counts_per_rev + lines)));
  raw.stator_C = static_cast<float>(values.stator_C);
  return raw;
}

}  // namespace imrig::plant
