#pragma once
// The machine with mapped parameters, in the frame that turns with w_k (Proca and Keyhani 2002; ERRATA form with
// flux states, which stays explicit when parameters vary):
//   i_s = (psi_s - psi_r) / L_l(|i_s|),   i_m = g_m(|psi_r|) psi_r, g_m the inverse of psi = L_m(I_d) I_d
//   e   = (i_s - i_m + j w_r psi_r / R_r) / (1/R_c + 1/R_r),  dpsi_r/dt = e - j w_k psi_r
//   dpsi_s/dt = v - R_s i_s - j w_k psi_s
//   R_r = kappa R_1(T) / (1 - kappa k_6 |Im(psi_r* i_r)| / |psi_r|^2), i_r = (e - j w_r psi_r)/R_r
// A map that is not known leaves its parameter at the base model's value. Steady state: a fixed point over the
// phasor circuit.

#include <complex>
#include <vector>

#include "estimators/fit/maps/parameter_maps.h"
#include "estimators/model/base_machine.h"

namespace imrig::est {

class MappedMachine {
 public:
  using Scalar = double;
  using State = FluxState<double>;

  // base: used where a map is missing.
  MappedMachine(const ParameterMaps& maps, const MachineParameters<double>& base, double stator_C, double w_supply);

  Cx<double> current(const State& x) const;
  State derivative(const State& x, std::complex<double> v, double w_r, double w_k) const;

  double R_s() const { return R_s_; }
  double L_l(double I_A) const { return maps_->L_l.known() ? maps_->L_l.at(I_A) : base_.L_l; }
  // 1/L_m at a rotor flux.
  double inverse_L_m(double psi_Wb) const;
  double R_c(double w_e, double psi_Wb) const;
  double R_r(double w_s, double psi_Wb) const;

 private:
  double R_1() const { return maps_->R_r.known() ? maps_->R_r.at(0.0, stator_C_) : base_.R_r; }
  double kappa(double psi_Wb) const;

  const ParameterMaps* maps_;
  MachineParameters<double> base_;
  double stator_C_, w_supply_, R_s_;
  std::vector<double> flux_, inverse_;  // table of 1/L_m over evenly spaced flux
};

struct MappedSteady {
  std::complex<double> i_s;  // A, peak, at a real voltage
  double p_in_W = 0.0;
  bool settled = false;
};
MappedSteady mapped_steady(const MappedMachine& machine, double v_peak_V, double w_e, double w_r);

}  // namespace imrig::est
