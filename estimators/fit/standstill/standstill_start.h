#pragma once
// Starting values of the standstill fit: plain least squares on the paper's regressors (parametric.h), which
// is within a few per cent where its filters suit the motor; and a grid scaled by the record's impedance
// where they do not.

#include <vector>

#include "estimators/fit/standstill/axis_record.h"
#include "estimators/model/base_machine.h"

namespace imrig::est {

// Best guess first; never empty.
std::vector<MachineParameters<double>> standstill_starts(const AxisRecord& record);

}  // namespace imrig::est
