#pragma once
// A value that moves to its target at no more than a given rate.

#include <algorithm>

namespace imrig {

struct Ramp {
  double value = 0.0;
  double rate_per_s = 0.0;

  void advance(double target, double dt_s) {
    const double most = rate_per_s * std::max(dt_s, 0.0);
    value += std::clamp(target - value, -most, most);
  }
};

}  // namespace imrig
