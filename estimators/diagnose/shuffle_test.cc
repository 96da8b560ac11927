#include "estimators/diagnose/shuffle_test.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

namespace imrig::est {

namespace {

constexpr std::size_t kDraws = 1999;

// Ranks, ties shared, centred and of unit mean square.
std::vector<double> scores(const std::vector<double>& x) {
  std::vector<std::size_t> order(x.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return x[a] < x[b]; });
  std::vector<double> out(x.size());
  for (std::size_t k = 0; k < order.size();) {
    std::size_t end = k;
    while (end < order.size() && x[order[end]] == x[order[k]]) ++end;
    for (std::size_t m = k; m < end; ++m)
      out[order[m]] = 0.5 * (static_cast<double>(k + end) - static_cast<double>(order.size()));
    k = end;
  }
  double sum2 = 0.0;
  for (const double r : out) sum2 += r * r;
  if (sum2 > 0.0) {
    for (double& r : out) r *= std::sqrt(static_cast<double>(x.size()) / sum2);
  }
  return out;
}

// Share of the figure's variation between groups, over the units that have one.
double between(const std::vector<double>& figure, const std::vector<int>& group,
               const std::vector<std::size_t>& from) {
  std::vector<double> sum, count;
  double all = 0.0, all2 = 0.0, n = 0.0;
  for (std::size_t u = 0; u < figure.size(); ++u) {
    const int g = group[from[u]];
    if (g == kNoGroup) continue;
    const auto at = static_cast<std::size_t>(g);
    if (at >= sum.size()) sum.resize(at + 1, 0.0), count.resize(at + 1, 0.0);
    sum[at] += figure[u];
    count[at] += 1.0;
    all += figure[u];
    all2 += figure[u] * figure[u];
    n += 1.0;
  }
  const double total = all2 - (n > 0.0 ? all * all / n : 0.0);
  if (!(total > 1e-12)) return 0.0;
  double inside = 0.0;
  for (std::size_t g = 0; g < sum.size(); ++g) {
    if (count[g] > 0.0) inside += sum[g] * sum[g] / count[g];
  }
  return (inside - all * all / n) / total;
}

double adjusted(double share, const std::vector<int>& group) {
  const auto n = static_cast<double>(std::count_if(group.begin(), group.end(), [](int g) { return g >= 0; }));
  const double k = 1.0 + *std::max_element(group.begin(), group.end());
  return n > k ? std::max(0.0, 1.0 - (1.0 - share) * (n - 1.0) / (n - k)) : 0.0;
}

std::vector<std::vector<std::size_t>> draws(std::size_t units, Shuffle how, std::uint64_t seed) {
  std::vector<std::size_t> order(units);
  std::iota(order.begin(), order.end(), 0u);
  std::vector<std::vector<std::size_t>> out{order};  // the data themselves first
  std::mt19937_64 random(seed);
  const std::size_t count = how == Shuffle::kCircle ? units - 1 : kDraws;
  for (std::size_t k = 0; k < count; ++k) {
    if (how == Shuffle::kCircle) {
      std::rotate(order.begin(), order.begin() + 1, order.end());
    } else {
      for (std::size_t u = units - 1; u > 0; --u) std::swap(order[u], order[random() % (u + 1)]);
    }
    out.push_back(order);
  }
  return out;
}

// Share of the draws, the data among them, that are at least as large.
std::vector<double> p_values(const std::vector<double>& statistic) {
  std::vector<double> sorted = statistic;
  std::sort(sorted.begin(), sorted.end());
  std::vector<double> out;
  for (const double s : statistic) {
    const auto first = std::lower_bound(sorted.begin(), sorted.end(), s - 1e-12);
    out.push_back(static_cast<double>(sorted.end() - first) / static_cast<double>(sorted.size()));
  }
  return out;
}

}  // namespace

std::vector<Dependence> shuffle_test(const std::vector<std::vector<double>>& figures,
                                     const std::vector<std::vector<int>>& groups, Shuffle how,
                                     std::uint64_t seed) {
  std::vector<Dependence> out(groups.size());
  if (figures.empty() || groups.empty() || figures.front().size() < 2) return out;
  std::vector<std::vector<double>> ranks;
  for (const auto& figure : figures) ranks.push_back(scores(figure));
  const auto all = draws(figures.front().size(), how, seed);
  std::vector<double> smallest(all.size(), 1.0), own;
  for (std::size_t c = 0; c < groups.size(); ++c) {
    double strongest = -1.0;
    own.push_back(1.0);
    for (std::size_t k = 0; k < ranks.size(); ++k) {
      std::vector<double> share;
      for (const auto& draw : all) share.push_back(between(ranks[k], groups[c], draw));
      if (share.front() > strongest) strongest = share.front(), out[c].figure = k;
      const std::vector<double> p = p_values(share);
      own.back() = std::min(own.back(), p.front());
      for (std::size_t d = 0; d < all.size(); ++d) smallest[d] = std::min(smallest[d], p[d]);
    }
    out[c].share = adjusted(strongest, groups[c]);
  }
  for (std::size_t c = 0; c < groups.size(); ++c) {
    const auto as_small =
        std::count_if(smallest.begin(), smallest.end(), [&](double p) { return p <= own[c] + 1e-12; });
    out[c].p_value = static_cast<double>(as_small) / static_cast<double>(all.size());
  }
  return out;
}

}  // namespace imrig::est
