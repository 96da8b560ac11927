#pragma once
// From physical values to what the DSP reads: count = round((1 + gain error) x / scale + offset + noise),
// clipped to the converter's range; scale = range / 2^(bits-1). The encoder counts whole lines; each is
// missed with the probability encoder_loss, and missed counts stay missed. The voltage
// filter is not here but in voltage_filter.h.

#include <array>
#include <cstdint>

#include "plant/effects/effect.h"
#include "plant/noise.h"
#include "plant/plant.h"
#include "plant/plant_config.h"

namespace imrig::plant {

struct SensorErrors {
  std::array<double, 3> current_gain{}, voltage_gain{};  // relative
  std::array<double, 3> current_offset_counts{}, voltage_offset_counts{};
};

SensorScale sensor_scale(const SensorsConfig& config);

// What this seed draws; all zero for ideal sensors.
SensorErrors draw_sensor_errors(const SensorsConfig& config, std::uint64_t seed);

class Sensors {
 public:
  Sensors(const SensorsConfig& config, std::uint64_t seed);
  RawSample sample(const Measured& values, std::int64_t turns);
  SensorScale scale() const { return scale_; }

 private:
  std::int64_t count(std::int64_t lines);
  std::int16_t convert(double value, double gain, double offset_counts, double noise, double per_count);

  SensorsConfig config_;
  SensorScale scale_;
  SensorErrors errors_;
  Noise noise_;
  Noise missing_;                        // stream of the missed counts
  std::int64_t seen_ = 0, counted_ = 0;  // lines passed, and those of them that were counted
  bool first_ = true;
};

}  // namespace imrig::plant
