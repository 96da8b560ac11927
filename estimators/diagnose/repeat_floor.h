#pragma once
// The noise floor from repeats: records of the same conditions share the model's error, so what differs
// between their residuals is noise, whatever its source. Variance of a sample: sum over repeats |r - mean|^2
// / (n - 1), residuals turned to a common voltage phase.

#include <vector>

#include "estimators/diagnose/compare_series.h"

namespace imrig::est {

// repeats: two or more, in the same order. Replaces floor and chi2 of both channels of each record.
void set_floor_from_repeats(const std::vector<const Residual*>& residuals,
                            const std::vector<ComparedRecord*>& records);

}  // namespace imrig::est
