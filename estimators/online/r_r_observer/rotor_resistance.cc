#include "estimators/online/r_r_observer/rotor_resistance.h"

#include <cmath>
#include <limits>

namespace imrig::est {

RotorResistance rotor_resistance(const RotorCircuit& circuit, double impedance_ohm, double phi_rad,
                                 double w_e_rad_s, double slip) {
  RotorResistance out;
  out.R_r_ohm = std::numeric_limits<double>::quiet_NaN();
  const double X = w_e_rad_s * circuit.L_m_H;
  const double a = impedance_ohm * std::cos(phi_rad) - circuit.R_s_ohm;
  const double root = X * X - 4.0 * a * a;
  if (!(root >= 0.0)) return out;
  if (a == 0.0) {
    out.status = RotorResistanceStatus::kNoPower;
    return out;
  }
  out.sensitivity = X / std::sqrt(root);
  out.upper_root = std::abs(slip) < circuit.R_r_near_ohm / X;
  const double seen =
      X * (out.upper_root ? X + std::sqrt(root) : X - std::sqrt(root)) / (2.0 * a);  // R', signed
  // Iron draws power whatever the slip's sign: it comes off as a conductance.
  const double conductance = 1.0 / seen - (circuit.R_c_ohm > 0.0 ? 1.0 / circuit.R_c_ohm : 0.0);
  const double R_r = slip / conductance;
  if (!(R_r > 0.0) || !std::isfinite(R_r)) {
    out.status = RotorResistanceStatus::kNoPower;
  } else if (out.sensitivity > kMostSensitivity) {
    out.status = RotorResistanceStatus::kIllConditioned;
  } else {
    out.status = RotorResistanceStatus::kValid;
    out.R_r_ohm = R_r;
  }
  return out;
}

}  // namespace imrig::est
