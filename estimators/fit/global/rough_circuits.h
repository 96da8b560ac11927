#pragma once
// Circuits that the motor of a data set may have, from the data alone: where to start when nobody knows it.
// From the level of the impedance Z = v/i near the largest power, the shares of it that motors have; from
// single steady points, the circuits that agree with them (start_guess.h); all judged by the steady points,
// |ln(i_model/i)|^2 as phasors, and a little by how common such a motor is, which decides where the points
// leave it open. A start and no result: effects, noise and transients are left to the fit.

#include <array>
#include <vector>

#include "estimators/model/base_machine.h"
#include "rig/data/record.h"

namespace imrig::est {

// held: R_s, R_r, L_l, L_m where they are known, NaN elsewhere. The best first, no two alike (10 %), at most
// `most`; without a steady point in the order of a grid. Empty where no record that is fitted has voltage and
// current.
std::vector<MachineParameters<double>> rough_circuits(const DataSet& data, const std::array<double, 4>& held,
                                                      std::size_t most, int threads);

}  // namespace imrig::est
