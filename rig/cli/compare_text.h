#pragma once
// Where a model fails, as the terminal shows it: short; the whole is in the JSON and in the report.

#include "estimators/diagnose/compare.h"

namespace imrig {

void print_map(const est::FailureMap& map);
void print_lines(const est::OrderSpectrum& spectrum);
void print_worst(const est::CompareResult& result);

// A condition as people write it: "flux, Wb"; and the factor to that unit.
struct ShownCondition {
  std::string text;
  double scale = 1.0;
};
ShownCondition shown_condition(const std::string& name);

// "0.31 to 0.42", "50", "backward".
std::string shown_bin(const std::string& condition, const est::MapBin& bin);

}  // namespace imrig
