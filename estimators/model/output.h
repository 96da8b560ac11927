#pragma once
// What a model says about a steady operating point of a table: current, power, torque from voltage, frequency
// and measured speed.

#include "estimators/model/model.h"
#include "estimators/model/steady_state.h"

namespace imrig::est {

// Throws Error when voltage, frequency or speed is missing.
SteadyPoint predict_point(const MachineParameters<double>& machine, int pole_pairs,
                          const SteadyPoint& measured);

}  // namespace imrig::est
