#include "estimators/fit/table_records.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "estimators/fit/points_fit.h"

namespace imrig::est {

namespace {

RecordEstimate estimate_of(const PointsFit& fit, std::size_t m, double value,
                           const IdentifyOptions& options) {
  RecordEstimate estimate{value, fit.sigma[m], fit.per_R_s[m], base_parameters()[m].unit, "", false};
  if (fit.on_bound[m]) {
    estimate.left_out = "lies on a bound of the search";
  } else if (!(fit.sigma[m] <= options.max_relative_sigma * value)) {
    estimate.left_out = fmt::format("its own sigma is {:.2g} %", 100.0 * fit.sigma[m] / value);
    estimate.weak = true;
  }
  return estimate;
}

}  // namespace

void fit_table_record(const DataSet& data, const Record& record, double R_s,
                      const std::optional<MachineParameters<double>>& start, const IdentifyOptions& options,
                      RecordResult& result) {
  PointsOptions points;
  points.pole_pairs = data.pole_pairs;
  points.noise = data.noise;
  points.R_s = R_s;
  if (start) points.starts.push_back(*start);
  const PointsFit fit = fit_points(record.points, points);
  result.notes = fit.notes;
  result.nrmse = fit.nrmse;
  result.chi2_per_dof = fit.chi2_per_dof;
  result.rejected = fit.failure;
  if (!fit.failure.empty()) return;
  const std::array values{fit.theta.R_s, fit.theta.R_r, fit.theta.L_l, fit.theta.L_m};
  for (std::size_t m = std::isfinite(R_s) ? 1 : 0; m < values.size(); ++m) {
    const char* name = base_parameters()[m].name;
    const RecordEstimate estimate = estimate_of(fit, m, values[m], options);
    if (estimate.left_out.empty()) result.used_for.push_back(name);
    result.parameters[name] = estimate;
  }
}

}  // namespace imrig::est
