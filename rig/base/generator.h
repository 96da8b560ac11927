#pragma once
// Nominal salient-free synchronous generator on a resistor box, steady state:
//   E = w k i_f,  Z = (R_a + R_load) + j w L_s,  T = (3/2) p E^2 (R_a + R_load) / (w |Z|^2),  w = p w_M.
// The shaft carries the losses in R_a too. Torque rises with the square of the excitation and, below w L_s = R, with speed.
// For set-points and predictions only; nothing is identified with it.

#include <algorithm>
#include <cmath>

#include "rig/base/rig_config.h"

namespace imrig {

// Torque in N m that one squared ampere of field current asks of the shaft at a mechanical speed in rad/s; 0 at rest.
inline double torque_per_field_A2(const GeneratorConfig& generator, double speed_rad_s) {
  const double w = generator.pole_pairs * std::abs(speed_rad_s);
  const double R = generator.R_a_ohm + generator.R_load_ohm;
  const double X = w * generator.L_s_H;
  const double k = generator.flux_per_field_A_Wb;
  return 1.5 * generator.pole_pairs * k * k * w * R / (R * R + X * X);
}

inline double shaft_torque_Nm(const GeneratorConfig& generator, double speed_rad_s, double field_A) {
  return torque_per_field_A2(generator, speed_rad_s) * field_A * field_A;
}

// Field current for a shaft torque; infinite at rest when a torque is asked for.
inline double field_A_for_torque(const GeneratorConfig& generator, double speed_rad_s, double torque_Nm) {
  if (torque_Nm <= 0.0) return 0.0;
  return std::sqrt(torque_Nm / torque_per_field_A2(generator, speed_rad_s));
}

// The most field current that the excitation supply can hold: its current limit, or its voltage over the field's resistance.
inline double most_field_A(const GeneratorConfig& generator, const DynoConfig& supply) {
  return std::min(supply.max_A, supply.max_V / generator.R_field_ohm);
}

}  // namespace imrig
