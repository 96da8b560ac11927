#pragma once
// The machine with mapped parameters, in the frame that turns with w_k (Proca and Keyhani 2002; ERRATA form with
// flux states, which stays explicit when parameters vary):
//   i_s = (psi_s - psi_r) / L_l(|i_s|),   i_m = g_m(|psi_r|) psi_r, g_m the inverse of psi = L_m(I_d) I_d
//   e   = (i_s - i_m + j w_r psi_r / R_r) / (1/R_c + 1/R_r),  dpsi_r/dt = e - j w_k psi_r
//   dpsi_s/dt = v - R_s i_s - j w_k psi_s
//   R_r = kappa R_1(T) / (1 - kappa k_6 |Im(psi_r* i_r)| / |psi_r|^2), i_r = (e - j w_r psi_r)/R_r
// With bars (deep_bar.h) the rotor is R_1 in series with R_2 || L_2 instead, i_2 the current of L_2, in the rotor's frame a
// state of its own; psi_r is then the flux before L_2, so that L_l is smaller by L_2 and L_m larger:
//   e - j w_r psi_r = R_1' i_r + R_2' (i_r - i_2),   L_2 (di_2/dt - j w_r i_2) = R_2' (i_r - i_2)
//   R' = kappa (1 + L_2/L_m)^2 R, what a circuit with leakage on the rotor's side needs for the same R_r at small slip
// L_2 itself is left at its unsaturated value: where kappa is 0.96 that is 0.3 % of L_l.
// A map that is not known leaves its parameter at the base model's value. Steady state: a fixed point over the
// phasor circuit.

#include <complex>
#include <vector>

#include "estimators/fit/maps/parameter_maps.h"
#include "estimators/model/base_machine.h"
#include "estimators/model/simulate.h"

namespace imrig::est {

struct MappedState {
  Cx<double> psi_s, psi_r, i_2;
};
inline MappedState ahead(const MappedState& x, double h, const MappedState& d) {
  return {ahead(x.psi_s, h, d.psi_s), ahead(x.psi_r, h, d.psi_r), ahead(x.i_2, h, d.i_2)};
}
inline MappedState stepped(const MappedState& x, double h, const MappedState& a, const MappedState& b, const MappedState& c,
                           const MappedState& d) {
  return {stepped(x.psi_s, h, a.psi_s, b.psi_s, c.psi_s, d.psi_s), stepped(x.psi_r, h, a.psi_r, b.psi_r, c.psi_r, d.psi_r),
          stepped(x.i_2, h, a.i_2, b.i_2, c.i_2, d.i_2)};
}

class MappedMachine {
 public:
  using Scalar = double;
  using State = MappedState;

  // base: used where a map is missing.
  MappedMachine(const ParameterMaps& maps, const MachineParameters<double>& base, double stator_C, double w_supply);

  Cx<double> current(const State& x) const;
  State derivative(const State& x, std::complex<double> v, double w_r, double w_k) const;

  double R_s() const { return R_s_; }
  double L_l(double I_A) const { return maps_->L_l.known() ? maps_->L_l.at(I_A) : base_.L_l; }
  // Between psi_s and psi_r.
  double series_L(double I_A) const { return L_l(I_A) - L_2_; }
  // 1/L_m at a rotor flux; with bars that of L_m + L_2.
  double inverse_L_m(double psi_Wb) const;
  double R_c(double w_e, double psi_Wb) const;
  // Of the rotor branch over slip, at a steady slip frequency: R_r + j w_s L.
  std::complex<double> rotor(double w_s, double psi_Wb) const;
  // The state of a steady run at small slip with this stator flux and current.
  State steady_state(std::complex<double> psi_s, std::complex<double> i_s) const;

 private:
  double R_1() const { return maps_->R_r.known() ? maps_->R_r.at(0.0, stator_C_) : base_.R_r; }
  bool bars() const { return L_2_ > 0.0; }
  // What multiplies R_1 and R_2.
  double kappa(double psi_Wb) const;
  Cx<double> rotor_emf(const State& x, const Cx<double>& drive, double k, double iron, double w_r, Cx<double>& d_i_2) const;
  Cx<double> line_emf(const State& x, const Cx<double>& drive, double k, double iron, double w_r) const;

  const ParameterMaps* maps_;
  MachineParameters<double> base_;
  double stator_C_, w_supply_, R_s_;
  double R_2_ = 0.0, L_2_ = 0.0;  // of the bars, at this temperature
  std::vector<double> flux_, inverse_;  // table of 1/L_m over evenly spaced flux
};

struct MappedSteady {
  std::complex<double> i_s;  // A, peak, at a real voltage
  double p_in_W = 0.0;
  bool settled = false;
};
MappedSteady mapped_steady(const MappedMachine& machine, double v_peak_V, double w_e, double w_r);

}  // namespace imrig::est
