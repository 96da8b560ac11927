#include "estimators/fit/standstill/standstill_search.h"

#include <algorithm>
#include <cmath>

#include "estimators/fit/standstill/standstill_start.h"

namespace imrig::est::standstill {

namespace {

constexpr int kMostIterations = 60;
constexpr double kLongestStep = 0.7;     // of any ln theta
constexpr double kSettledSigmas = 1e-4;  // a step below this many sigmas ends the search ...
constexpr double kSettled = 1e-10;       // ... or below this much of ln theta
constexpr double kShortStart_s = 1.5;    // of the record, on which the starts are ranked
constexpr int kRanked = 2;

}  // namespace

Search descend(const AxisRecord& record, const Point& start, std::size_t n, int most, const Prior& prior) {
  Search s;
  s.at = start;
  Sums here = prior.with(whole(evaluate(record, s.at, n, 1)), s.at);
  s.cost = here.cost;
  double damping = 1e-4;
  for (; s.iterations < most && !s.settled; ++s.iterations) {
    Vector step = -Scaled(here.H, damping).solve(here.g);
    const double longest = step.head<kTheta>().cwiseAbs().maxCoeff();
    if (!std::isfinite(longest)) break;
    if (longest > kLongestStep) step *= kLongestStep / longest;
    const Point next = s.at.moved(step);
    const double variance = here.cost / static_cast<double>(n);
    const bool small = step.dot(here.H * step) < kSettledSigmas * kSettledSigmas * variance ||
                       step.head<kTheta>().cwiseAbs().maxCoeff() < kSettled;
    if (!steppable(theta_of(next), record.sample_time_s)) {
      damping = std::max(10.0 * damping, 1e-3);
      continue;
    }
    const Sums there = prior.with(whole(evaluate(record, next, n, 1)), next);
    if (there.cost < here.cost) {
      s.at = next;
      s.cost = there.cost;
      here = there;
      damping *= 0.1;
      s.settled = small;
    } else if (small) {
      s.settled = true;
    } else {
      damping = std::max(10.0 * damping, 1e-6);
    }
  }
  return s;
}

Search search(const AxisRecord& record, const StandstillFitOptions& options) {
  auto starts = standstill_starts(record);
  if (options.nominal) starts.push_back(*options.nominal);
  std::erase_if(starts, [&](const auto& p) { return !steppable(p, record.sample_time_s); });
  const auto some = std::min(record.size(), static_cast<std::size_t>(kShortStart_s / record.sample_time_s));
  std::vector<Search> ranked;
  for (const auto& start : starts) ranked.push_back(descend(record, point_of(start), some, 3));
  std::sort(ranked.begin(), ranked.end(), [](const auto& a, const auto& b) { return a.cost < b.cost; });
  Search best;
  for (std::size_t k = 0; k < std::min<std::size_t>(kRanked, ranked.size()); ++k) {
    Search one = descend(record, ranked[k].at, record.size(), kMostIterations);
    if (one.cost < best.cost) best = one;
  }
  return best;
}

Search search_with(const AxisRecord& record, const Point& start, const Prior& prior) {
  return descend(record, start, record.size(), kMostIterations, prior);
}

}  // namespace imrig::est::standstill
