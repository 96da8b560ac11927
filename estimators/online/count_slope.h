#pragma once
// Slope of a straight line through encoder counts, least squares, in counts per sample, with one sigma.
//
// Counts are rounded: the residual stays on one side for as long as a count lasts, so of N samples only about
// as many are independent as counts pass by. sigma^2 = 12 r^2 / (N^2 N_eff), N_eff = N min(1, |slope|), r the
// residual's rms.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>

namespace imrig::est {

struct CountSlope {
  double per_sample = 0.0;
  double sigma = 0.0;
};

// At least 2 counts, unwrapped.
inline CountSlope fit_count_slope(std::span<const std::int64_t> counts) {
  const auto n = static_cast<double>(counts.size());
  const double middle = 0.5 * (n - 1.0);
  const std::int64_t origin = counts.front();
  double sum = 0.0, moment = 0.0, square = 0.0;
  for (std::size_t k = 0; k < counts.size(); ++k) {
    const auto count = static_cast<double>(counts[k] - origin);
    sum += count;
    moment += (static_cast<double>(k) - middle) * count;
    square += count * count;
  }
  const double spread = n * (n * n - 1.0) / 12.0;
  const double slope = moment / spread;
  const double left = std::max(square - sum * sum / n - moment * moment / spread, 0.0);
  const double independent = std::max(n * std::min(1.0, std::abs(slope)), 1.0);
  return {slope, std::sqrt(12.0 * (left / n) / (n * n * independent))};
}

}  // namespace imrig::est
