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
};

bool is_series_kind(RecordKind kind);  // what the transient fit can take

// Fits the listed records, in parallel; results in the list's order, the same whatever the number of threads.
std::vector<RecordResult> fit_series_records(const DataSet& data, const std::vector<std::size_t>& which,
                                             const SeriesSetting& setting, const IdentifyOptions& options);

}  // namespace imrig::est
