#include "estimators/fit/standstill/standstill_records.h"

#include <fmt/format.h>

#include <cmath>
#include <memory>

#include "estimators/fit/assemble.h"
#include "rig/base/error.h"

namespace imrig::est {

namespace {

constexpr double kWorstMisfit = 0.3;  // nrmse above which the machine model says nothing about the record

StandstillFitOptions fit_options(const DataSet& data, const IdentifyOptions& options) {
  StandstillFitOptions out;
  out.noise = data.noise;
  if (!options.nominal) return out;
  const Model& m = *options.nominal;
  if (m.R_s.known() && m.R_r.known() && m.L_l.known() && m.L_m.known()) out.nominal = m.machine();
  return out;
}

KnownResistance seen_along(const DcResistance& dc, double axis_rad, const Accuracy& accuracy) {
  const double between = std::sqrt(2.0 / 3.0) * std::abs(std::sin(axis_rad - dc.axis_rad));
  return {dc.value_ohm, std::hypot(dc.relative_sigma, between * gain_sigma(accuracy))};
}

StandstillReport report_of(const AxisRecord& axis, const StandstillFitOptions& options) {
  StandstillReport report;
  report.fit = fit_standstill(axis, options);
  report.seconds = axis.sample_time_s * static_cast<double>(axis.size());
  report.axis_rad = axis.angle_rad;
  const GradientEstimator published = run_gradient(axis, report.published);
  report.published_c = published.c();
  report.published_circuit = published.circuit();
  return report;
}

void take_estimates(const StandstillFit& fit, const IdentifyOptions& options, RecordResult& row) {
  const std::array<double, kStandstillParameters> values{fit.theta.R_s, fit.theta.R_r, fit.theta.L_l,
                                                         fit.theta.L_m};
  for (std::size_t k = 0; k < values.size(); ++k) {
    RecordEstimate estimate;
    estimate.value = values[k];
    estimate.sigma = fit.sigma[k] * values[k];
    estimate.unit = base_parameters()[k].unit;
    estimate.left_out = row.rejected;
    if (row.rejected.empty() && !(fit.sigma[k] <= options.max_relative_sigma)) {
      estimate.left_out = fmt::format("its own sigma is {:.2g} %, above {:.2g} %", 100.0 * fit.sigma[k],
                                      100.0 * options.max_relative_sigma);
      estimate.weak = true;
    }
    if (estimate.left_out.empty()) row.used_for.push_back(kStandstillNames[k]);
    row.parameters[kStandstillNames[k]] = estimate;
  }
}

}  // namespace

void fit_standstill_record(const DataSet& data, const Record& record, const IdentifyOptions& options,
                           const std::optional<DcResistance>& R_s, RecordResult& row) {
  try {
    const AxisRecord axis = axis_record(record.series, data.pole_pairs);
    if (!axis.failure.empty()) {
      row.rejected = axis.failure;
      return;
    }
    StandstillFitOptions wanted = fit_options(data, options);
    if (R_s) wanted.R_s = seen_along(*R_s, axis.angle_rad, data.accuracy);
    const auto report = std::make_shared<StandstillReport>(report_of(axis, wanted));
    report->gain_sigma = gain_sigma(data.accuracy);
    const StandstillFit& fit = report->fit;
    row.i_peak_A = std::sqrt(2.0) * fit.current_A;
    row.nrmse = fit.nrmse;
    row.chi2_per_dof = fit.chi2_per_dof;
    row.rejected = fit.failure;
    if (row.rejected.empty() && fit.nrmse > kWorstMisfit)
      row.rejected = fmt::format("the machine model misses the current by {:.0f} %", 100.0 * fit.nrmse);
    take_estimates(fit, options, row);
    row.standstill = report;
  } catch (const Error& e) {
    row.rejected = e.what();
  }
}

}  // namespace imrig::est
