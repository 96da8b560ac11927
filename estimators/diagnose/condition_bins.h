#pragma once
// Bins of a condition that the data choose: its own clusters where there are few, and of what is in one
// cluster parts of equal count (equal values stay together). A condition that hardly varies has one bin or
// none.

#include <vector>

namespace imrig::est {

// One bin number a value, 0 the lowest; kNoGroup (-1) for NaN. Bins are numbered without gaps.
std::vector<int> condition_bins(const std::vector<double>& values);

}  // namespace imrig::est
