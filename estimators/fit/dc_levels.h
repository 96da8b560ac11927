#pragma once
// Cuts a DC record into its levels of current.

#include <cstddef>
#include <vector>

#include "rig/data/record.h"

namespace imrig::est {

struct Stretch {
  std::size_t begin = 0;
  std::size_t end = 0;
  std::size_t size() const { return end - begin; }
};

// Stretches with the gates on: by profile segment where the record names them, otherwise wherever the current
// vector, averaged over blocks, stays within a tenth of the largest current. Stretches without current (below
// 2 % of the largest) are left out.
std::vector<Stretch> dc_stretches(const TimeSeries& series);

}  // namespace imrig::est
