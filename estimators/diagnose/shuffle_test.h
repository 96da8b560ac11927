#pragma once
// Does any of several figures of a unit depend on any of several groupings of the units? Permutation test:
// the groupings are shuffled among the units, all by the same draw; the statistic is the figure's share of
// variation between groups, of its ranks (Kruskal and Wallis); p is family-wise over all figures and
// groupings (min p, single step; Westfall and Young 1993), exact but for the number of draws.

#include <cstdint>
#include <vector>

namespace imrig::est {

inline constexpr int kNoGroup = -1;  // the condition has no value there

struct Dependence {
  double p_value = 1.0;
  double share = 0.0;      // adjusted share of the strongest figure's variation, 0..1
  std::size_t figure = 0;  // the strongest
};

enum class Shuffle { kFree, kCircle };  // kCircle keeps the order of units and shifts it: every shift once

// figures[k][unit], finite; groups[c][unit], kNoGroup or 0, 1, ... One entry a grouping.
std::vector<Dependence> shuffle_test(const std::vector<std::vector<double>>& figures,
                                     const std::vector<std::vector<int>>& groups, Shuffle how,
                                     std::uint64_t seed);

}  // namespace imrig::est
