#pragma once
// What a model's magnetics come to for a drive, active effects included:
//   magnetizing  at no load (no rotor current), against the rotor's flux: i_d, L_m = psi_r/i_d, its increment
//   d psi_r/d i_d leakage      at one rotor flux, against the torque current i_q: L_l = |psi_s - psi_r|/|i_s|
// Inverse-gamma circuit, per phase of the equivalent star, peak values; the model's own fluxes are solved
// for, so any effect that bends currents is in. Without one all columns but the first are constant or
// straight.

#include <vector>

#include "estimators/model/model.h"

namespace imrig::est {

struct MagnetizingRow {
  double i_d_A = 0.0, psi_r_Wb = 0.0, L_m_H = 0.0, L_m_incremental_H = 0.0;
};
struct LeakageRow {
  double i_q_A = 0.0, i_s_A = 0.0, L_l_H = 0.0;
};

// Throws Error when the model is incomplete or its magnetics give no current for a flux.
std::vector<MagnetizingRow> magnetizing_table(const Model& model, double psi_max_Wb, int rows);
std::vector<LeakageRow> leakage_table(const Model& model, double psi_r_Wb, double i_q_max_A, int rows);

}  // namespace imrig::est
