#pragma once
// The records that a model fits worst: farthest above their noise floor; where a floor is not known, with the
// largest relative error. Time series only: they have an overlay to look at.

#include <vector>

#include "estimators/diagnose/compare.h"

namespace imrig::est {

inline constexpr std::size_t kOverlays = 4;  // as many are shown

std::vector<const ComparedRecord*> worst_records(const CompareResult& result, std::size_t most);

}  // namespace imrig::est
