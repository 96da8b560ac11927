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

// The steady stretches of these records, in their order; records that cannot be used are left out.
std::vector<SteadyPoint> steady_points(const DataSet& data, const std::vector<std::size_t>& which,
                                       int threads);

// R_s NaN: fitted too. Nothing when there are fewer than two points.
std::optional<DataNominal> nominal_from_points(const std::vector<SteadyPoint>& all, int pole_pairs,
                                               double R_s);

// The largest flux (peak phase voltage over electrical frequency) of the points, Wb; NaN when there is none.
double largest_flux_Wb(const std::vector<SteadyPoint>& points);

}  // namespace imrig::est
