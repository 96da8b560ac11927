#pragma once
// Current, speed and winding temperature of a block of samples against the rig's limits.
//
// Current: |i| = |(2/3)(i_a + a i_b + a^2 i_c)| of each sample, sensor zeros not removed. A clipped current
// channel counts as over the limit, since nobody knows how much flowed. Speed: encoder counts over windows of
// at least 4 ms, across block borders and gaps. Temperature: a NaN is a rig without a thermocouple, unless
// one was there before: missing for a second, it counts as hot.

#include <cstdint>
#include <imrig_msg/samples_t.hpp>
#include <limits>

#include "rig/base/rig_config.h"
#include "rig/safety/trip.h"

namespace imrig {

// What of a block counts most. NaN where nothing was measured.
struct BlockExtremes {
  double current_A = 0.0;          // largest |space vector|
  std::int64_t current_index = 0;  // its sample
  bool current_clipped = false;
  double speed_rpm = std::numeric_limits<double>::quiet_NaN();  // the window with the largest |speed|, else
                                                                // the last one known
  double stator_C = std::numeric_limits<double>::quiet_NaN();
  Trip trip = Trip::kNone;  // the first limit violated: current, speed, temperature
};

class LimitMonitor {
 public:
  explicit LimitMonitor(const LimitsConfig& limits) : limits_(limits) {}
  // samples: as published, n <= 256 and arrays of that length. A new boot_id starts the speed measurement
  // anew.
  BlockExtremes check(const imrig_msg::samples_t& samples);

 private:
  void speed_of(const imrig_msg::samples_t& samples, BlockExtremes& out);
  bool thermocouple_gone(const imrig_msg::samples_t& samples);

  LimitsConfig limits_;
  std::int64_t boot_id_ = 0;
  bool anchored_ = false;
  std::int64_t anchor_index_ = 0;
  std::int32_t anchor_encoder_ = 0;
  double speed_rpm_ = std::numeric_limits<double>::quiet_NaN();
  bool thermocouple_seen_ = false;
  std::int64_t thermocouple_index_ = 0;  // last sample with a temperature
};

}  // namespace imrig
