#include "rig/data/short_holes.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "rig/data/uniform.h"

namespace imrig {

namespace {

constexpr std::size_t kRowsPerHole = 100;

// The cubic through (-2, y0), (-1, y1), (gap, y2), (gap + 1, y3) at x.
double cubic(const std::array<double, 4>& y, double gap, double x) {
  const std::array<double, 4> at{-2.0, -1.0, gap, gap + 1.0};
  double sum = 0.0;
  for (std::size_t k = 0; k < 4; ++k) {
    double weight = 1.0;
    for (std::size_t m = 0; m < 4; ++m) {
      if (m != k) weight *= (x - at[m]) / (at[k] - at[m]);
    }
    sum += weight * y[k];
  }
  return sum;
}

}  // namespace

std::size_t fill_short_holes(const std::vector<double>& t_s, std::vector<double>& x) {
  const auto missing = [](double value) { return std::isnan(value); };
  const auto holes = static_cast<std::size_t>(std::count_if(x.begin(), x.end(), missing));
  if (holes == 0 || holes * kRowsPerHole > x.size()) return 0;
  // Stamps that are missing are refused later; the median cannot order them.
  if (!std::all_of(t_s.begin(), t_s.end(), [](double t) { return std::isfinite(t); })) return 0;
  const double step_s = median_step(t_s);
  std::size_t filled = 0;
  for (std::size_t k = 2; k + 2 < x.size(); ++k) {
    if (!missing(x[k]) || missing(x[k - 1]) || missing(x[k - 2])) continue;
    std::size_t end = k;
    while (end < x.size() && missing(x[end])) ++end;
    const auto even = [&] {
      for (std::size_t m = k - 1; m <= end + 1; ++m) {
        if (!(t_s[m] - t_s[m - 1] < kGap * step_s)) return false;
      }
      return true;
    };
    if (end - k <= kLongestHole && end + 1 < x.size() && !missing(x[end + 1]) && even()) {
      const std::array<double, 4> y{x[k - 2], x[k - 1], x[end], x[end + 1]};
      const auto gap = static_cast<double>(end - k);
      for (std::size_t m = k; m < end; ++m) x[m] = cubic(y, gap, static_cast<double>(m - k));
      filled += end - k;
    }
    k = end;
  }
  return filled;
}

}  // namespace imrig
