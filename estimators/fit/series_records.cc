#include "estimators/fit/series_records.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>

#include "estimators/fit/each.h"
#include "estimators/fit/maps/sensitivity.h"
#include "estimators/fit/start_guess.h"
#include "estimators/fit/steady_windows.h"
#include "estimators/fit/transient_fit.h"
#include "rig/base/error.h"

namespace imrig::est {

namespace {

constexpr double kWorstMisfit = 0.3;   // nrmse above which the machine model says nothing about the record
constexpr double kBlind = 0.1;         // relative sigma from which a record does not see a parameter
constexpr double kBackwardSlip = 1.8;  // a rotor that turns against the field: slip about 2
constexpr std::array<const char*, kCircuit> kNames{"R_s", "R_r", "L_l", "L_m"};
constexpr std::array<const char*, kCircuit> kUnits{"ohm", "ohm", "H", "H"};

TransientOptions transient_options(const FrameRecord& record, const DataSet& data,
                                   const SeriesSetting& setting) {
  const int pole_pairs = data.pole_pairs;
  TransientOptions options;
  options.nominal = setting.nominal;
  options.noise = data.noise;
  options.bounds_move = setting.nominal_from_data;
  options.fit_R_s = setting.fit_R_s;
  options.saturation_flux_Wb = std::isfinite(setting.saturation_flux_Wb) ? setting.saturation_flux_Wb : 1e9;
  for (const auto& point : steady_windows(record, pole_pairs)) {
    options.starts = guesses_from_point(point, pole_pairs, setting.nominal.R_s);
    if (!options.starts.empty()) return options;
  }
  const MeanConditions mean = mean_conditions(record);
  const double w = std::max({std::abs(2.0 * kPi * mean.f_Hz), std::abs(record.w_k), 2.0 * kPi});
  options.starts = guesses_from_impedance(mean.v_peak_V / mean.i_peak_A, w, setting.nominal.R_s);
  return options;
}

double relative_sigma(const TransientFit& fit, int m) {
  const auto values = std::array{fit.theta.R_s, fit.theta.R_r, fit.theta.L_l, fit.theta.L_m};
  return std::sqrt(std::max(0.0, fit.noise.covariance(m, m))) / values[static_cast<std::size_t>(m)];
}

// The paper's rule: R_r and L_l from slips above it, L_m from those below.
bool on_wrong_side(int m, double slip, const IdentifyOptions& options) {
  if (!(options.slip_rule > 0.0) || m == 0) return false;
  const bool wants_slip = m < 3;
  return wants_slip != (std::abs(slip) > options.slip_rule);
}

std::string slip_reason(int m, double slip, const IdentifyOptions& options) {
  if (!on_wrong_side(m, slip, options)) return "";
  return fmt::format("slip {:.2g} % lies on the wrong side of the {:.2g} % rule", 100.0 * slip,
                     100.0 * options.slip_rule);
}

std::string own_reason(const TransientFit& fit, int m, double slip, const IdentifyOptions& options) {
  if (fit.on_bound[static_cast<std::size_t>(m)]) return "lies on a bound of the search";
  const double relative = relative_sigma(fit, m);
  if (relative <= options.max_relative_sigma) return "";
  return fmt::format("its own sigma is {:.2g} %, above {:.2g} % (slip {:.2g} %)", 100.0 * relative,
                     100.0 * options.max_relative_sigma, 100.0 * slip);
}

// A fit that wanders along a valley does so because the record cannot separate what lies along it.
std::string blind_to(const TransientFit& fit, const IdentifyOptions& options) {
  std::string names;
  for (int m = 0; m < kCircuit; ++m) {
    if (!(relative_sigma(fit, m) <= options.max_relative_sigma)) {
      names += fmt::format("{}{} (sigma {:.2g} %)", names.empty() ? "" : ", ",
                           kNames[static_cast<std::size_t>(m)], 100.0 * relative_sigma(fit, m));
    }
  }
  return names.empty() ? "" : ": the record cannot separate " + names;
}

std::string rejection(const TransientFit& fit, const IdentifyOptions& options) {
  if (!fit.failure.empty()) return fit.failure + blind_to(fit, options);
  if (fit.flux_on_bound) return "the initial flux lies beyond 200 % of saturation";
  if (fit.nrmse > kWorstMisfit)
    return fmt::format("the machine model misses the current by {:.0f} %", 100.0 * fit.nrmse);
  return "";
}

void judge(const TransientFit& fit, bool fit_R_s, const IdentifyOptions& options, RecordResult& result) {
  result.rejected = rejection(fit, options);
  const auto values = std::array{fit.theta.R_s, fit.theta.R_r, fit.theta.L_l, fit.theta.L_m};
  bool blind = false;  // to some parameter: then its other weak estimates lie along the same valley
  for (int m = fit_R_s ? 0 : 1; m < kCircuit; ++m) {
    blind = blind || fit.on_bound[static_cast<std::size_t>(m)] || !(relative_sigma(fit, m) < kBlind);
  }
  std::string reasons;
  for (int m = fit_R_s ? 0 : 1; m < kCircuit; ++m) {
    const auto k = static_cast<std::size_t>(m);
    RecordEstimate estimate;
    estimate.value = values[k];
    estimate.sigma = std::sqrt(std::max(0.0, fit.noise.covariance(m, m)));
    estimate.per_R_s = fit.noise.per_R_s[m];
    estimate.unit = kUnits[k];
    estimate.sensitivity = fit.sensitivity[k];
    estimate.left_out = !result.rejected.empty() ? result.rejected : own_reason(fit, m, result.slip, options);
    if (estimate.left_out.empty()) {
      estimate.left_out = slip_reason(m, result.slip, options);
      estimate.by_rule = !estimate.left_out.empty();
    }
    estimate.weak = result.rejected.empty() && !estimate.left_out.empty() && !blind;
    if (!estimate.left_out.empty())
      reasons += (reasons.empty() ? "" : "; ") + std::string(kNames[k]) + ": " + estimate.left_out;
    if (estimate.left_out.empty()) result.used_for.push_back(kNames[k]);
    result.parameters[kNames[k]] = estimate;
  }
  if (result.rejected.empty() && result.used_for.empty())
    result.rejected = "determines no parameter: " + reasons;
}

// Against the declared noise of the current, and of the voltage through the machine.
double chi2_per_dof(const TransientFit& fit, const Noise& declared) {
  if (!(declared.current_A > 0.0)) return kMissing;
  const double voltage = declared.voltage_V > 0.0 ? declared.voltage_V : 0.0;
  return fit.residual_A * fit.residual_A /
         (fit.noise.current_gain * declared.current_A * declared.current_A +
          fit.noise.voltage_gain * voltage * voltage);
}

// R_s at the record's own winding temperature, where that is known.
SeriesSetting at_temperature(const SeriesSetting& setting, const TimeSeries& series) {
  SeriesSetting own = setting;
  if (setting.fit_R_s || setting.R_s_per_K == 0.0) return own;
  double sum = 0.0, n = 0.0;
  for (const double T : series.stator_C) {
    if (!std::isfinite(T)) continue;
    sum += T;
    n += 1.0;
  }
  if (n > 0.0) own.nominal.R_s *= 1.0 + setting.R_s_per_K * (sum / n - setting.R_s_reference_C);
  return own;
}

void fit_one(const DataSet& data, const Record& record, const SeriesSetting& shared,
             const IdentifyOptions& options, RecordResult& result) {
  const SeriesSetting setting = at_temperature(shared, record.series);
  const FrameRecord frame = to_driving_frame(record.series, data.pole_pairs);
  const MeanConditions mean = mean_conditions(frame);
  result.f_Hz = mean.f_Hz;
  result.slip = mean.slip;
  result.v_peak_V = mean.v_peak_V;
  result.i_peak_A = mean.i_peak_A;
  if (!(mean.i_peak_A > 0.0) || !(mean.v_peak_V > 0.0)) {
    result.rejected = "has no current or no voltage";
    return;
  }
  if (mean.slip > kBackwardSlip) {
    result.rejected =
        "the speed runs against the field: the phase order or the sign of the speed is reversed";
    return;
  }
  const TransientFit fit = fit_transient(frame, transient_options(frame, data, setting));
  result.nrmse = fit.nrmse;
  result.chi2_per_dof = chi2_per_dof(fit, data.noise);
  judge(fit, setting.fit_R_s, options, result);
}

// The middle of what the records tell, where they tell it.
MachineParameters<double> middle_of(const std::vector<RecordResult>& results,
                                    MachineParameters<double> machine) {
  const std::array<double*, kCircuit> places{&machine.R_s, &machine.R_r, &machine.L_l, &machine.L_m};
  for (std::size_t m = 1; m < places.size(); ++m) {
    std::vector<double> told;
    for (const RecordResult& r : results) {
      const auto found = r.parameters.find(kNames[m]);
      if (found != r.parameters.end() && found->second.left_out.empty()) told.push_back(found->second.value);
    }
    if (told.empty()) continue;
    const auto half = told.begin() + static_cast<std::ptrdiff_t>(told.size() / 2);
    std::nth_element(told.begin(), half, told.end());
    *places[m] = *half;
  }
  return machine;
}

// Records whose current a parameter hardly moves in steady operation do not speak for it.
void drop_insensitive(const MachineParameters<double>& machine, double least, RecordResult& result) {
  if (!std::isfinite(result.slip) || !(std::abs(result.f_Hz) > 0.0)) return;
  const Sensitivity S = sensitivity_at(machine, 2.0 * kPi * std::abs(result.f_Hz), result.slip);
  for (auto& [name, estimate] : result.parameters) {
    if (!estimate.left_out.empty() || !(S.of(name) < least)) continue;
    estimate.by_rule = true;
    estimate.left_out = fmt::format("its computed sensitivity S/I = {:.2g} (slip {:.2g} %) lies below {:.2g}",
                                    S.of(name), 100.0 * result.slip, least);
    std::erase(result.used_for, name);
    if (result.used_for.empty())
      result.rejected = "determines no parameter: " + name + ": " + estimate.left_out;
  }
}

}  // namespace

bool is_series_kind(RecordKind kind) {
  return kind != RecordKind::kDc && kind != RecordKind::kPoints && kind != RecordKind::kLockedSweep;
}

std::vector<RecordResult> fit_series_records(const DataSet& data, const std::vector<std::size_t>& which,
                                             const SeriesSetting& setting, const IdentifyOptions& options) {
  std::vector<RecordResult> results(which.size());
  std::mutex telling;
  std::size_t done = 0;
  each(which.size(), options.threads, [&](std::size_t k) {
    const Record& record = data.records[which[k]];
    results[k].id = record.id;
    results[k].kind = record.kind;
    try {
      fit_one(data, record, setting, options, results[k]);
    } catch (const std::exception& e) {
      results[k].rejected = e.what();
    }
    const std::lock_guard lock(telling);
    ++done;
    if (options.progress) options.progress({done, which.size(), record.id});
  });
  if (options.least_sensitivity > 0.0) {
    const MachineParameters<double> machine = middle_of(results, setting.nominal);
    for (RecordResult& result : results) drop_insensitive(machine, options.least_sensitivity, result);
  }
  return results;
}

}  // namespace imrig::est
