// The order of a campaign's points: declared in sequence.h.

#include <algorithm>
#include <limits>
#include <tuple>
#include <utility>
#include <vector>

#include "rig/campaign/sequence.h"

namespace imrig {

namespace {

constexpr std::size_t kMostForGreedy = 1500;

double duration_s(const Travel& travel, const std::vector<Action>& actions) {
  double total = 0.0;
  for (const Action& action : actions)
    total += action.wait_s + static_cast<double>(action.profile.total_samples()) * travel.sample_time_s;
  return total;
}

using Points = std::vector<CheckedPoint>;

// Fills time_s along the given order; returns the sum.
double walk(const Travel& travel, Points& points) {
  Operating here;
  double excitation = 0.0;
  double total = 0.0;
  for (CheckedPoint& point : points) {
    point.time_s = duration_s(travel, actions_for(travel, point, here, excitation));
    total += point.time_s;
    here = operating_after(point);
    excitation = point.excitation_A;
  }
  return total;
}

// Frequencies upwards, voltages up and down in turn, loads upwards.
Points serpentine(Points points) {
  std::vector<double> frequencies;
  for (const CheckedPoint& p : points) frequencies.push_back(p.point.frequency_Hz);
  std::sort(frequencies.begin(), frequencies.end());
  frequencies.erase(std::unique(frequencies.begin(), frequencies.end()), frequencies.end());
  const auto key = [&](const CheckedPoint& p) {
    const auto row =
        std::lower_bound(frequencies.begin(), frequencies.end(), p.point.frequency_Hz) - frequencies.begin();
    return std::make_tuple(row, row % 2 == 0 ? p.voltage_V : -p.voltage_V, p.load_Nm);
  };
  std::stable_sort(points.begin(), points.end(),
                   [&](const auto& a, const auto& b) { return key(a) < key(b); });
  return points;
}

// Always the nearest next.
Points greedy(const Travel& travel, Points points, Operating here) {
  Points order;
  double excitation = 0.0;
  while (!points.empty()) {
    std::size_t best = 0;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < points.size(); ++k) {
      const double time = duration_s(travel, actions_for(travel, points[k], here, excitation));
      if (time < least) std::tie(best, least) = std::make_pair(k, time);
    }
    here = operating_after(points[best]);
    excitation = points[best].excitation_A;
    order.push_back(points[best]);
    points.erase(points.begin() + static_cast<std::ptrdiff_t>(best));
  }
  return order;
}

}  // namespace

std::vector<CheckedPoint> order_points(const Travel& travel, std::vector<CheckedPoint> points) {
  Points resting_ones;
  Points running;
  Points last;
  for (CheckedPoint& p : points) {
    if (!p.feasible) continue;
    const PointKind kind = p.point.kind;
    (begins_at_rest(kind)            ? resting_ones
     : kind == PointKind::kCoastDown ? last
                                     : running)
        .push_back(std::move(p));
  }
  std::stable_sort(resting_ones.begin(), resting_ones.end(),
                   [](const auto& a, const auto& b) { return a.point.kind < b.point.kind; });
  const auto joined = [&](const Points& middle) {
    Points all = resting_ones;
    all.insert(all.end(), middle.begin(), middle.end());
    all.insert(all.end(), last.begin(), last.end());
    return all;
  };
  Points best = joined(serpentine(running));
  const double time = walk(travel, best);
  if (running.size() > kMostForGreedy) return best;
  const Operating start = resting_ones.empty() ? Operating{} : operating_after(resting_ones.back());
  Points other = joined(greedy(travel, running, start));
  return walk(travel, other) < time ? other : best;
}

}  // namespace imrig
