#pragma once
// What the report's charts draw, as JSON for script.js.

#include <string>

#include "estimators/diagnose/compare.h"

namespace imrig {

std::string chart_data(const est::CompareResult& result);

}  // namespace imrig
