#pragma once
// Time-series records to their estimates: the transient fit of each record, and the decision which parameters
// the record speaks for. The decision comes from the computed covariance: relative sigma below
// options.max_relative_sigma. The paper's rule (R_r and L_l from slips above 2 %, L_m from those below) is
// what this comes to for steady records of a linear motor; options.slip_rule applies it on top.

#include <vector>

#include "estimators/fit/identify.h"

namespace imrig::est {

// What all records share.
struct SeriesSetting {
  MachineParameters<double> nominal;  // R_s: the value used, unless fit_R_s
  bool nominal_from_data = false;     // then bounds move, and each record also tries starts of its own
  bool fit_R_s = false;
  double saturation_flux_Wb = kMissing;  // NaN: no bound
  double R_s_per_K = 0.0;  // relative to nominal.R_s: each record has R_s at its own winding temperature
  double R_s_reference_C = kMissing;
};

// What the transient fit can take. A locked-like sweep is left to its own method: with skin effect R_r is another
// one at each of its frequencies.
bool is_series_kind(RecordKind kind);

// Fits the listed records, in parallel; results in the list's order, the same whatever the number of threads.
std::vector<RecordResult> fit_series_records(const DataSet& data, const std::vector<std::size_t>& which,
                                             const SeriesSetting& setting, const IdentifyOptions& options);

}  // namespace imrig::est
