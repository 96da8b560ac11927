#include "estimators/fit/goodness.h"

#include <cmath>

#include "estimators/fit/series_records.h"
#include "estimators/model/predict.h"
#include "rig/base/error.h"

namespace imrig::est {

namespace {

struct Pool {
  double error = 0.0;
  double signal = 0.0;
  double nrmse() const { return signal > 0.0 ? std::sqrt(error / signal) : kMissing; }
};

void add(const MachineParameters<double>& machine, int pole_pairs, const TimeSeries& series, Pool& pool) {
  try {
    const CurrentPrediction prediction = predict_current(machine, pole_pairs, series);
    for (std::size_t k = 0; k < prediction.measured.size(); ++k) {
      pool.error += std::norm(prediction.predicted[k] - prediction.measured[k]);
      pool.signal += std::norm(prediction.measured[k]);
    }
  } catch (const Error&) {
    // The fit has said why this record cannot be used.
  }
}

}  // namespace

Goodness goodness(const MachineParameters<double>& machine, const DataSet& data) {
  Pool fitted, holdout;
  for (const auto& record : data.records) {
    if (is_series_kind(record.kind))
      add(machine, data.pole_pairs, record.series, record.holdout ? holdout : fitted);
  }
  return {fitted.nrmse(), holdout.nrmse()};
}

}  // namespace imrig::est
