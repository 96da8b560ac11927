#pragma once
// A table of operating points to its estimates: the phasor fit (points_fit.h), and which parameters it speaks
// for.

#include <optional>

#include "estimators/fit/identify.h"

namespace imrig::est {

// R_s NaN: fitted too. start: one more start for the search. Fills result; throws Error when the speeds
// contradict the pole pairs.
void fit_table_record(const DataSet& data, const Record& record, double R_s,
                      const std::optional<MachineParameters<double>>& start, const IdentifyOptions& options,
                      RecordResult& result);

}  // namespace imrig::est
