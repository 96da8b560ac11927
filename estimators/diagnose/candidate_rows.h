#pragma once
// The table of a diagnosis: what each effect of the library would be.

#include "estimators/diagnose/diagnose.h"

namespace imrig::est {

// One row an effect: its best trial in `step`, or its best score where it was not worth one. What was
// accepted comes first.
void add_candidates(const GlobalProblem& problem, const SearchStep& step, Diagnosis& out);

bool accepted(const Diagnosis& d, std::size_t effect);

}  // namespace imrig::est
