#pragma once
// Rotor resistance from one steady operating point (Proca and Keyhani 2002, appendix; its last formula lost a
// factor s). Inverse-gamma circuit: the real part of what lies behind R_s and jX_l is that of jX beside
// R_r/s,
//   a = (V/I) cos(phi) - R_s = R' X^2/(R'^2 + X^2),   X = w_e L_m,   R' = R_r/s
//   R' = X (X -+ sqrt(X^2 - 4 a^2))/(2 a)
// The upper sign is the root with R' < X: slip above R_r/X, 0.9 % at 60 Hz for a 5 hp motor. Below that slip
// the other root is the true one; near it neither is any good: d ln R'/d ln a = -+X/sqrt(X^2 - 4 a^2). 2 a >
// X has no real root: L_m, R_s or the measurement is wrong. That is told, never clamped. L_l plays no part.
// A core-loss resistance R_c beside jX (equation 20) takes its share exactly: 1/R' = 1/R'_seen - 1/R_c.
// Where the model's iron saturates, or takes power at the stator flux, the phasors tell the fluxes,
//   psi_s = (V - R_s I)/(j w_e),  psi_r = psi_s - L_l I',  psi_x = place psi_r + (1 - place) psi_s,
//   I' = I - G_s (V - R_s I) - (1 - place) g(|psi_x|) psi_x/L_m
//   L_m' = L_m/(1 + place g Re(psi_x/psi_r)),   G_x = place g Im(psi_x/psi_r)/(w_e L_m)
// with g of magnetizing_saturation. I' and L_m' go into the formula instead, and the conductance G_x comes off like
// the iron's: exact for a circuit of this form. A few rounds; without both, nothing changes and L_l plays no part.

#include <complex>

#include "estimators/model/effects/saturation_law.h"

namespace imrig::est {

enum class RotorResistanceStatus {
  kValid,
  kNoSpeed,        // speed not measured
  kNotSteady,      // the operating point still moves
  kSlipTooSmall,   // below the least slip
  kNotReal,        // 2 a > X: no real root
  kNoPower,        // a <= 0 at positive slip or a >= 0 at negative: sign of power and slip disagree
  kIllConditioned,  // too near to the slip R_r/X where both roots meet
  kImplausible      // less than a third or more than three times the model's: the speed or the model is wrong
};

// What saturation adds to the current of a linear L_m, relative to it (saturation_law.h).
class MagneticCurve {
 public:
  MagneticCurve() = default;  // none
  MagneticCurve(double extra, double exponent, double place, double bend, double psi_ref_Wb,
                double onset = 0.0)
      : extra_(extra), place_(place), curve_(extra, exponent, bend, psi_ref_Wb, onset) {}

  bool none() const { return extra_ <= 0.0; }
  double place() const { return place_; }

  // What the flux of the saturating branch adds to the linear current, relative to it.
  double share(std::complex<double> psi_x) const { return curve_.share(Cx<double>(psi_x)); }

 private:
  double extra_ = 0.0, place_ = 1.0;
  SaturationCurve<double> curve_;
};

struct RotorCircuit {
  double R_s_ohm = 0.0;
  double L_m_H = 0.0;
  double R_c_ohm = 0.0;       // 0: no core loss in the model
  double R_r_near_ohm = 0.0;  // a rough value: which root is the true one
  double L_l_H = 0.0;         // used only with what follows
  double stator_iron_S = 0.0;  // conductance of the iron at the stator flux
  MagneticCurve saturation = {};
  double current_A = 0.0;  // |I|, peak, of the point: the curve is not linear
};

struct RotorResistance {
  RotorResistanceStatus status = RotorResistanceStatus::kNotReal;
  double R_r_ohm = 0.0;      // NaN unless valid
  double sensitivity = 0.0;  // |d ln R_r/d ln a|
  bool upper_root = false;   // R' > X was taken: slip below R_r/X
};

inline constexpr double kMostSensitivity = 20.0;

// impedance_ohm: V/I; phi_rad: voltage ahead of current; w_e_rad_s > 0; slip: negative when generating.
RotorResistance rotor_resistance(const RotorCircuit& circuit, double impedance_ohm, double phi_rad,
                                 double w_e_rad_s, double slip);

}  // namespace imrig::est
