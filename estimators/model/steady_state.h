#pragma once
// Sinusoidal steady state of the base machine, per phase of the equivalent star, peak values. With w_s = w_e
// - w_r, tau = L_m / R_r:
//   Z = R_s + j w_e (L_l + L_m / (1 + j w_s tau))
// which is equation (9) of Proca and Keyhani 2002 without its division by the slip, so it holds at
// synchronism and at w_e = 0. Torque against slip by the Thevenin circuit seen from R_r/s (V_t, Z_t = R_t + j
// X_t):
//   T = (K x) / ((R_t + x)^2 + X_t^2), x = R_r/s, K = (3/2) n_p |V_t|^2 / w_e; pull-out at x = |Z_t|.
// T is double or ceres::Jet.

#include <cmath>
#include <optional>

#include "estimators/model/base_machine.h"
#include "rig/base/space_vector.h"

namespace imrig::est {

// The supply voltage lies on the real axis.
template <class T>
struct SteadyState {
  Cx<T> i_s;      // A, peak
  Cx<T> psi_s;    // Wb
  Cx<T> psi_r;    // Wb
  T current_A{};  // |i_s|
  T p_in_W{};
  T q_var{};         // positive: inductive
  T power_factor{};  // p_in / (3/2 |v| |i|); negative when generating
  T torque_Nm{};     // air gap
  T p_mech_W{};      // torque times mechanical speed
};

// v_peak_V: phase, peak. w_e, w_r: electrical, rad/s.
template <class T, class W>
SteadyState<T> steady_state(const MachineParameters<T>& p, int pole_pairs, double v_peak_V, double w_e,
                            const W& w_r) {
  using std::sqrt;
  const Cx<T> lag(T(1.0), T(w_e - w_r) * (p.L_m / p.R_r));
  const Cx<T> L_rotor = Cx<T>(p.L_m, T(0.0)) / lag;
  const Cx<T> L_seen(p.L_l + L_rotor.re, L_rotor.im);
  const Cx<T> Z(p.R_s - w_e * L_seen.im, w_e * L_seen.re);
  SteadyState<T> s;
  s.i_s = Cx<T>(T(v_peak_V), T(0.0)) / Z;
  s.psi_r = L_rotor * s.i_s;
  s.psi_s = L_seen * s.i_s;
  s.current_A = sqrt(norm(s.i_s));
  s.p_in_W = 1.5 * v_peak_V * s.i_s.re;
  s.q_var = -1.5 * v_peak_V * s.i_s.im;
  s.power_factor = s.i_s.re / s.current_A;
  s.torque_Nm = airgap_torque_Nm(pole_pairs, s.psi_s, s.i_s);
  s.p_mech_W = s.torque_Nm * T(w_r) * (1.0 / pole_pairs);
  return s;
}

// The largest motoring torque at a voltage and a frequency (w_e > 0).
struct PullOut {
  double slip = 0.0;
  double torque_Nm = 0.0;
};
PullOut pull_out(const MachineParameters<double>& p, int pole_pairs, double v_peak_V, double w_e);

// Slip (per unit of w_e) at which the air-gap torque has the given value, on the stable branch; negative
// torque: generating. Nothing when the machine cannot carry it. w_e > 0.
std::optional<double> slip_for_torque(const MachineParameters<double>& p, int pole_pairs, double v_peak_V,
                                      double w_e, double torque_Nm);

// Steady state at a given air-gap torque; nothing above pull-out.
struct LoadedState {
  double slip = 0.0;
  double speed_rad_s = 0.0;  // mechanical
  SteadyState<double> state;
};
std::optional<LoadedState> operating_point(const MachineParameters<double>& p, int pole_pairs,
                                              double v_peak_V, double f_Hz, double torque_Nm);

}  // namespace imrig::est
