#pragma once
// A diagnosis in sentences for people.

#include <string>
#include <vector>

#include "estimators/diagnose/diagnose.h"

namespace imrig::est {

// What was found at import: data that are wrong look like physics.
void repeat_warnings(const DataSet& data, Diagnosis& d);

// What was found, what it rests on and what may be doubted. without: effects that were ruled out.
void explain(const GlobalProblem& problem, const std::vector<std::string>& without, Diagnosis& d);

}  // namespace imrig::est
