#pragma once
// The operating conditions of each entry of a problem, by name: what errors may depend on.

#include <array>
#include <vector>

#include "estimators/fit/global/global_problem.h"

namespace imrig::est {

struct NamedCondition {
  const char* name;
  std::vector<double> values;  // one an entry asked for; NaN where it has no meaning
};

std::vector<NamedCondition> record_conditions(const GlobalProblem& problem, double R_s_ohm,
                                              const std::vector<std::size_t>& which);

}  // namespace imrig::est
