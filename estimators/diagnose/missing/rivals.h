#pragma once
// Second thoughts about effects that were accepted one after the other: each is taken out and its rivals put
// in its place beside all the others. A rival that predicts the records left out better takes the place; one
// that does as well is named.

#include "estimators/diagnose/missing/search.h"

namespace imrig::est {

// Makes search.findings from what search.final holds and `start` did not; may change search.final.
void settle_rivals(const GlobalProblem& problem, const WorkingModel& start, Search& search);

}  // namespace imrig::est
