#pragma once
// First guesses of the circuit from one steady phasor and a known R_s. The phasor gives two numbers for three
// unknowns, so the leakage is scanned: with Z = v/i and Y = 1/(Z - R_s - j w L_l), the rest follows in closed
// form,
//   R_r = s / Re Y,  L_m = -1 / (w Im Y),
// and the record's own transient says which leakage is right (the caller compares the errors).

#include <vector>

#include "estimators/model/base_machine.h"
#include "rig/data/record.h"

namespace imrig::est {

std::vector<MachineParameters<double>> guesses_from_point(const SteadyPoint& point, int pole_pairs,
                                                          double R_s);

// Where there is no steady stretch: a coarse grid over what machines have, scaled by the record's impedance
// |v|/|i| (ohm) at w (rad/s).
std::vector<MachineParameters<double>> guesses_from_impedance(double Z_ohm, double w_rad_s, double R_s);

}  // namespace imrig::est
