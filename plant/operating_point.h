#pragma once
// A steady operating point of a plant and what an ideal identification would find there. The real drive is
// run, shaft held at the speed of the slip, terminals on an ideal rotating voltage, until its phasors stand
// still; so whatever effects the plant has are in it, and nothing here knows any of them. The parameters are
// those of the T circuit whose phasors these are,
//   psi_m = L_m (i_s + i_r), psi_s - psi_m = L_ls i_s, psi_r - psi_m = L_lr i_r,   (secants)
//   R_r + j w_s L_x = -j w_s psi_r / i_bar,   (the rotor's answer at its slip frequency; L_x: what a ladder
//   adds)
// and of the inverse-gamma circuit that looks the same from the terminals, with k = L_m/(L_m + L_lr + L_x):
//   L_l = L_ls + (1 - k) L_m, L_m' = k L_m, R_r' = k^2 R_r, R_c = k^2/G_iron.
// Amplitude-invariant peak values. Where an effect turns with the shaft or the slip, means over whole supply
// periods are meant.

#include <complex>
#include <optional>
#include <string>

#include "plant/effects/effect.h"
#include "plant/truth.h"

namespace imrig::plant {

struct PlantConfig;

struct PointRequest {
  double f_Hz = 0.0, v_V = 0.0;    // of the terminals, V peak per phase
  std::optional<double> slip;      // one of both
  std::optional<double> load_Nm;   // at the shaft
  std::optional<double> stator_C;  // held; without: where the plant starts
  std::optional<double> rotor_C;
};

// "f_Hz=60,v_V=180,slip=0.03" or load_Nm= for slip=, and stator_C=, rotor_C=. Throws Error.
PointRequest parse_point_request(const std::string& text);

// d along the rotor's flux, q across it. H.
struct IncrementalInductance {
  double dd, dq, qq;
};

struct OperatingPoint {
  double f_Hz, v_V, slip, w_slip_rad_s, speed_rpm;
  std::complex<double> v_s, i_s, i_r, i_bar, psi_s, psi_r, psi_m;  // rotor flux on the real axis
  double torque_Nm, shaft_Nm, in_W, power_factor;
  Losses losses;
  Temperatures temperature;
  double R_s_ohm, R_r_ohm, L_m_H, L_ls_H, L_lr_H, L_x_H;  // T circuit, secant
  InverseGamma secant;
  std::optional<double> R_c_ohm;  // inverse-gamma
  // What small changes see. Inverse-gamma: L_l = d psi_s/d i_s at fixed rotor flux, L_s = L_l + L_m at fixed
  // rotor current. Ladders in the rotor's drop are not in them.
  IncrementalInductance L_l_incremental, L_m_incremental, L_mT_incremental;
};

// Throws Error where the request is no point of this motor.
OperatingPoint find_operating_point(const PlantConfig& config, const PointRequest& request);

}  // namespace imrig::plant
