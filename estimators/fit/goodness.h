#pragma once
// How well one model describes a data set's time-series records: rms of the current's residual over rms of
// the current, pooled.

#include "estimators/model/model.h"

namespace imrig::est {

struct Goodness {
  double fitted_nrmse = kMissing;
  double holdout_nrmse = kMissing;
};

// Records that cannot be simulated are left out; NaN where none is left.
Goodness goodness(const MachineParameters<double>& machine, const DataSet& data, int threads = 1);

}  // namespace imrig::est
