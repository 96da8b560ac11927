#pragma once
// A first circuit for the whole data set where the user gives none: the phasor fit over the steady stretches
// of all records. Only a start and the middle of the search bounds; nothing of it enters the result.

#include <optional>
#include <vector>

#include "estimators/model/base_machine.h"
#include "rig/data/record.h"

namespace imrig::est {

struct DataNominal {
  MachineParameters<double> theta;
};

// R_s NaN: fitted too. Nothing when there are no steady stretches.
std::optional<DataNominal> nominal_from_data(const DataSet& data, const std::vector<std::size_t>& which,
                                             double R_s);

// The largest steady flux (peak phase voltage over electrical frequency) in the records, Wb; NaN when there
// is none.
double largest_flux_Wb(const DataSet& data, const std::vector<std::size_t>& which);

}  // namespace imrig::est
