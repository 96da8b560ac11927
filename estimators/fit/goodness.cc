#include "estimators/fit/goodness.h"

#include <cmath>

#include "estimators/fit/each.h"
#include "estimators/fit/record_problem.h"
#include "estimators/fit/series_records.h"
#include "rig/base/error.h"

namespace imrig::est {

namespace {

struct Pool {
  double error = 0.0;
  double signal = 0.0;
  double nrmse() const { return signal > 0.0 ? std::sqrt(error / signal) : kMissing; }
};

Pool pool_of(const MachineParameters<double>& machine, int pole_pairs, const TimeSeries& series) {
  try {
    const FrameRecord record = to_driving_frame(series, pole_pairs);
    const RecordProblem problem(record, false, false);
    return {problem.error(machine), problem.signal()};
  } catch (const Error&) {
    return {};  // The fit has said why this record cannot be used.
  }
}

}  // namespace

Goodness goodness(const MachineParameters<double>& machine, const DataSet& data, int threads) {
  std::vector<Pool> pools(data.records.size());
  each(pools.size(), threads, [&](std::size_t k) {
    const Record& record = data.records[k];
    if (is_series_kind(record.kind)) pools[k] = pool_of(machine, data.pole_pairs, record.series);
  });
  Pool fitted, holdout;
  for (std::size_t k = 0; k < pools.size(); ++k) {
    Pool& pool = data.records[k].holdout ? holdout : fitted;
    pool.error += pools[k].error;
    pool.signal += pools[k].signal;
  }
  return {fitted.nrmse(), holdout.nrmse()};
}

}  // namespace imrig::est
