#include "estimators/fit/dc_levels.h"

#include <algorithm>
#include <cmath>
#include <complex>

namespace imrig::est {

namespace {

constexpr std::size_t kBlocks = 200;        // the record is averaged over, to find levels under noise
constexpr double kSameLevel = 0.1;          // of the largest current
constexpr double kNoCurrent = 0.02;         // likewise
constexpr std::size_t kShortestLevel = 16;  // samples

SpaceVector mean(const std::vector<SpaceVector>& x, std::size_t begin, std::size_t end) {
  SpaceVector sum{};
  for (std::size_t k = begin; k < end; ++k) sum += x[k];
  return sum / static_cast<double>(std::max<std::size_t>(1, end - begin));
}

bool gates_on(const TimeSeries& series, std::size_t k) {
  return series.gates_on.empty() || series.gates_on[k] != 0;
}

std::vector<Stretch> by_segment(const TimeSeries& series) {
  std::vector<Stretch> all;
  for (std::size_t begin = 0; begin < series.size();) {
    std::size_t end = begin;
    while (end < series.size() && series.segment[end] == series.segment[begin] &&
           gates_on(series, end) == gates_on(series, begin))
      ++end;
    if (gates_on(series, begin)) all.push_back({begin, end});
    begin = end;
  }
  return all;
}

std::vector<Stretch> by_current(const TimeSeries& series, double largest) {
  const std::size_t block = std::max<std::size_t>(1, series.size() / kBlocks);
  std::vector<Stretch> all;
  SpaceVector level{};
  for (std::size_t begin = 0; begin + block <= series.size(); begin += block) {
    if (!gates_on(series, begin) || !gates_on(series, begin + block - 1)) continue;
    const SpaceVector here = mean(series.i, begin, begin + block);
    const bool continues =
        !all.empty() && all.back().end == begin && std::abs(here - level) < kSameLevel * largest;
    if (!continues) all.push_back({begin, begin});
    all.back().end = begin + block;
    level = here;
  }
  return all;
}

double largest_current(const TimeSeries& series) {
  const std::size_t block = std::max<std::size_t>(1, series.size() / kBlocks);
  double largest = 0.0;
  for (std::size_t begin = 0; begin + block <= series.size(); begin += block) {
    largest = std::max(largest, std::abs(mean(series.i, begin, begin + block)));
  }
  return largest;
}

}  // namespace

std::vector<Stretch> dc_stretches(const TimeSeries& series) {
  const double largest = largest_current(series);
  std::vector<Stretch> all;
  for (const auto& stretch :
       series.segment.size() == series.size() ? by_segment(series) : by_current(series, largest)) {
    const std::size_t late = stretch.begin + stretch.size() / 2;
    if (stretch.size() >= kShortestLevel &&
        std::abs(mean(series.i, late, stretch.end)) > kNoCurrent * largest)
      all.push_back(stretch);
  }
  return all;
}

}  // namespace imrig::est
