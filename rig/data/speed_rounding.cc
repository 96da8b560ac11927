#include "rig/data/speed_rounding.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace imrig {

namespace {

constexpr std::size_t kSamplesPerValue = 20;  // so seldom a speed is new where it was rounded
constexpr std::size_t kFewestValues = 4;
constexpr double kSame = 1e-6;      // of the fastest: rounding in the file is no step
constexpr double kOnGrid = 0.05;    // of a step
constexpr double kCoarsest = 0.01;  // of the fastest: steps beyond it are counts
constexpr std::size_t kWindow = 100;
constexpr double kHeld = 0.2;  // share of slow windows in which the value does not change; of counts 0 to 0.11

// The smallest gap between neighbours, if all others are whole numbers of it.
double grid_of(const std::vector<double>& sorted, double fastest) {
  std::vector<double> gaps;
  for (std::size_t k = 1; k < sorted.size(); ++k) {
    const double gap = sorted[k] - sorted[k - 1];
    if (gap > kSame * fastest) gaps.push_back(gap);
  }
  if (gaps.size() + 1 < kFewestValues || (gaps.size() + 1) * kSamplesPerValue > sorted.size()) return 0.0;
  const double step = *std::min_element(gaps.begin(), gaps.end());
  const bool whole = std::all_of(gaps.begin(), gaps.end(), [step](double gap) {
    return std::abs(gap / step - std::round(gap / step)) < kOnGrid;
  });
  return whole ? step : 0.0;
}

}  // namespace

double rounded_speed_step(const DataSet& data) {
  std::vector<double> all;
  for (const Record& r : data.records) {
    std::copy_if(r.series.speed_rad_s.begin(), r.series.speed_rad_s.end(), std::back_inserter(all),
                 [](double w) { return std::isfinite(w) && w != 0.0; });
  }
  if (all.empty()) return 0.0;
  std::sort(all.begin(), all.end());
  const double fastest = std::max(std::abs(all.front()), std::abs(all.back()));
  const double step = grid_of(all, fastest);
  if (!(step > 0.0) || step > kCoarsest * fastest) return 0.0;
  double slow = 0.0, held = 0.0;
  for (const Record& r : data.records) {
    const auto& w = r.series.speed_rad_s;
    for (std::size_t k = 0; k + kWindow <= w.size(); k += kWindow) {
      const auto [low, high] = std::minmax_element(w.begin() + static_cast<std::ptrdiff_t>(k),
                                                   w.begin() + static_cast<std::ptrdiff_t>(k + kWindow));
      if (*high == 0.0 || !(*high - *low < 1.5 * step)) continue;  // at rest there is nothing to round
      slow += 1.0;
      held += *high - *low < 0.5 * step ? 1.0 : 0.0;
    }
  }
  return held > kHeld * slow ? step : 0.0;
}

}  // namespace imrig
