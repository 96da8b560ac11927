#include "estimators/online/r_r_observer/rotor_resistance.h"

#include <cmath>
#include <complex>
#include <limits>

namespace imrig::est {

namespace {

constexpr int kRounds = 6;  // of the flux; each settles it by a factor of ten or more

// What lies behind R_s as the formula wants it.
struct Behind {
  double a_ohm, L_m_H;
  double across_S = 0.0;  // what the saturating branch takes across the rotor flux looks like a conductance
};

Behind behind_stator(const RotorCircuit& c, double impedance_ohm, double phi_rad, double w_e) {
  const double a = impedance_ohm * std::cos(phi_rad) - c.R_s_ohm;
  if (c.saturation.none() && c.stator_iron_S <= 0.0) return {a, c.L_m_H};
  using Complex = std::complex<double>;
  // Per ampere of current; the curve needs volts, which the caller's scale gives.
  const Complex I = c.current_A, V = std::polar(impedance_ohm, phi_rad) * I;
  const Complex e = V - c.R_s_ohm * I, psi_s = e / Complex(0.0, w_e);
  const MagneticCurve& m = c.saturation;
  Complex behind = I - c.stator_iron_S * e, psi_r = psi_s - c.L_l_H * behind;
  double L_m = c.L_m_H, across = 0.0;
  for (int round = 0; round < kRounds && !m.none(); ++round) {
    const Complex psi_x = m.place() * psi_r + (1.0 - m.place()) * psi_s;
    const double g = m.share(psi_x);
    behind = I - c.stator_iron_S * e - ((1.0 - m.place()) * g / c.L_m_H) * psi_x;
    psi_r = psi_s - c.L_l_H * behind;
    // The rotor's branch: psi_r/L_m + place g psi_x/L_m.
    const Complex along = psi_x / psi_r;
    L_m = c.L_m_H / (1.0 + m.place() * g * along.real());
    across = m.place() * g * along.imag() / (w_e * c.L_m_H);
  }
  return {(e / behind).real(), L_m, across};
}

}  // namespace

RotorResistance rotor_resistance(const RotorCircuit& circuit, double impedance_ohm, double phi_rad,
                                 double w_e_rad_s, double slip) {
  RotorResistance out;
  out.R_r_ohm = std::numeric_limits<double>::quiet_NaN();
  const auto [a, L_m, across_S] = behind_stator(circuit, impedance_ohm, phi_rad, w_e_rad_s);
  const double X = w_e_rad_s * L_m;
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
  const double conductance = 1.0 / seen - across_S - (circuit.R_c_ohm > 0.0 ? 1.0 / circuit.R_c_ohm : 0.0);
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
