#pragma once
// A time series beside the model's simulation of it, and what noise alone would leave.

#include <complex>
#include <vector>

#include "estimators/diagnose/compare.h"
#include "estimators/diagnose/effect_prediction.h"

namespace imrig::est {

// Measured less predicted, kept for the comparison of repeats: turned so that the record's voltage starts on
// the real axis.
struct Residual {
  std::size_t first = 0;  // sample of the series that entry 0 belongs to
  std::vector<std::complex<double>> current;
  std::vector<double> power;
};

// speed_sigma_rad_s: of a held speed that was rounded (rig/data/speed_rounding.h); 0: it was not.
// Throws Error when the record cannot be judged.
Residual compare_series(const ModelPrediction& model, const DataSet& data, const Record& record,
                        const CompareOptions& options, double speed_sigma_rad_s, ComparedRecord& out);

}  // namespace imrig::est
