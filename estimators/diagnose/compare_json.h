#pragma once
// A comparison as other programs read it: keys may be added, never renamed. NaN is null.

#include <string>

#include "estimators/diagnose/compare.h"

namespace imrig::est {

inline constexpr int kCompareJsonVersion = 1;

std::string compare_json(const CompareResult& result);

}  // namespace imrig::est
