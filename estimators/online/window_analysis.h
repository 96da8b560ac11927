#pragma once
// One window of samples to an operating point, where a fundamental is found in it.

#include <optional>

#include "estimators/online/operating_point.h"
#include "estimators/online/window_buffer.h"

namespace imrig::est {

struct WindowFacts {
  double sample_time_s = 0.0;
  double voltage_filter_s = 0.0;
  int encoder_counts_per_rev = 0;
  int pole_pairs = 1;
  bool voltage_held = false;
  double leakage_H = 0.0;  // 0: no ripple to be undone
};

struct WindowFrequency {
  double rad_per_sample = 0.0;  // signed
  std::size_t samples = 0;      // of a whole number of periods, from the buffer's begin
};

inline constexpr int kLeastPeriods = 2;

// Nothing when the buffer does not hold two whole periods of a vector whose rms is above least_V.
std::optional<WindowFrequency> find_frequency(std::span<const std::complex<double>> v, double least_V);

// Electrical quantities; false when the fundamental holds less than half of the voltage's power.
bool analyse_electrical(const WindowBuffer& window, const WindowFrequency& frequency,
                        const WindowFacts& facts, OperatingPoint& out);

// Speed over the first n samples, and the slip where a frequency is known.
void analyse_speed(const WindowBuffer& window, std::size_t n, const WindowFacts& facts, OperatingPoint& out);

}  // namespace imrig::est
