#pragma once
// Records that nobody has taken, as the fit would see them: the voltage of a planned record in the frame of
// its supply at the data's own sampling, and where a model's fluxes stand after it has settled there.

#include "estimators/diagnose/missing/working_model.h"
#include "estimators/diagnose/next/experiment.h"

namespace imrig::est {

// Winding temperatures of a cold and of a hot motor, from the data; NaN where none was measured.
struct Heat {
  double cold_C = kMissing, hot_C = kMissing;
};
Heat heat_of(const GlobalProblem& problem);

// The data set with planned records behind its own.
GlobalProblem imagined(const GlobalProblem& problem, const WorkingModel& circuit,
                       const std::vector<PlannedRecord>& records);

// The model's point on such a problem: what belongs to each record alone (a warmth, a rotor angle) is taken
// from the data's records, initial fluxes from a run-up in the planned voltage.
GlobalPoint settled_in(const GlobalProblem& imagined, const WorkingModel& model,
                       const std::vector<PlannedRecord>& records);

}  // namespace imrig::est
