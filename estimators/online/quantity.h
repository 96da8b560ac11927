#pragma once
// An estimate as a drive engineer reads it: value, 95 % interval, and the sample it rests on.

#include <cmath>
#include <cstdint>
#include <limits>

namespace imrig::est {

inline constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kNormal95 = 1.959964;

struct Quantity {
  double value = kUnknown;
  double sigma = kUnknown;      // one sigma; NaN: nothing is known about the uncertainty
  std::int64_t last_index = 0;  // of the newest sample it rests on
  bool known() const { return !std::isnan(value); }
};

// relative: share of the value; absolute: in its unit.
inline Quantity quantity(double value, double absolute, double relative, std::int64_t last_index) {
  return {value, std::hypot(absolute, relative * value), last_index};
}

}  // namespace imrig::est
