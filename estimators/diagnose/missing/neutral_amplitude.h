#pragma once
// What was accepted may end with an amplitude that could as well be neutral: its shape takes the place of
// something else, and it explains nothing. An exponent and its amplitude trade places without that, so the
// amplitude is asked with the effect's own shapes as they are.

#include "estimators/diagnose/missing/working_model.h"

namespace imrig::est {

// Whether no amplitude of the candidate in this fit stands 1.96 standard errors off; false without
// amplitudes.
bool may_be_neutral(const WorkingModel& model, const Candidate& candidate);

}  // namespace imrig::est
