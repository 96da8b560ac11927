#pragma once
// Between equivalent circuits. All three are the same machine at the terminals.
//   T:             R_s, L_ls | L_m | L_lr, R_r      L_s = L_ls + L_m, L_r = L_lr + L_m
//   inverse-gamma: L_l = L_s - L_m^2/L_r, L_m' = L_m^2/L_r, R_r' = R_r (L_m/L_r)^2          (all leakage on
//   the stator side) gamma:         L_M = L_s, L_L = L_s (L_s L_r - L_m^2)/L_m^2, R_R = R_r (L_s/L_m)^2 (all
//   leakage on the rotor side)
// A T circuit holds one number more than the terminals show; it is fixed by the ratio L_s / L_r (1 by
// default). Source: Slemon 1989; checked in tests by the terminal impedance.

#include "estimators/model/base_machine.h"

namespace imrig::est {

struct TCircuit {
  double R_s = 0.0, R_r = 0.0, L_ls = 0.0, L_lr = 0.0, L_m = 0.0;
};
struct GammaCircuit {
  double R_s = 0.0, R_r = 0.0, L_L = 0.0, L_M = 0.0;
};

MachineParameters<double> inverse_gamma_of(const TCircuit& t);
MachineParameters<double> inverse_gamma_of(const GammaCircuit& g);
// Throws Error when the ratio L_s / L_r would make a leakage negative.
TCircuit t_of(const MachineParameters<double>& p, double L_s_over_L_r = 1.0);
GammaCircuit gamma_of(const MachineParameters<double>& p);

// Star-equivalent values times three: per phase of a winding in delta.
MachineParameters<double> delta_phase_of(const MachineParameters<double>& star);
MachineParameters<double> star_of(const MachineParameters<double>& delta_phase);

}  // namespace imrig::est
