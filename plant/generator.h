#pragma once
// The load: a round-rotor synchronous generator with field winding on a resistor box, dq model in the rotor's
// frame (motor signs, peak values):
//   psi_d = L i_d + M i_f,   psi_q = L i_q,   psi_f = L_f i_f + (3/2) M i_d,
//   d psi_d/dt = -R i_d + w psi_q,   d psi_q/dt = -R i_q - w psi_d,   d psi_f/dt = v_f - R_f i_f,
// R = R_a + R_load, w = p w_mech. Torque on the shaft (3/2) p (psi_d i_q - psi_q i_d), negative where it
// generates; steady state:
//   T = -(3/2) p w (M i_f)^2 R / (R^2 + (w L)^2).
// The field winding is linear and has no dampers beside it; an unexcited field is closed by the supply's
// freewheeling path. Source: Krause, Analysis of Electric Machinery, chapter 5, with L_d = L_q and without
// damper windings.

#include "plant/plant_config.h"

namespace imrig::plant {

class Generator {
 public:
  struct Flow {
    double i_d = 0.0, i_q = 0.0, i_f = 0.0;  // A
    double shaft_Nm = 0.0;                   // on the shaft, positive drives
    double d_psi_d = 0.0, d_psi_q = 0.0, d_psi_f = 0.0;
  };

  explicit Generator(const GeneratorConfig& config)
      : coupled_(config.coupled),
        p_(config.pole_pairs),
        L_(config.L_s_H),
        M_(config.flux_per_field_A_Wb),
        L_f_(config.L_field_H),
        R_(config.R_a_ohm + config.R_load_ohm),
        R_f_(config.R_field_ohm),
        D_(L_ * L_f_ - 1.5 * M_ * M_),
        dd_(L_f_ / D_),
        df_(M_ / D_),
        ff_(L_ / D_),
        qq_(1.0 / L_) {}

  Flow flow(double psi_d, double psi_q, double psi_f, double w_mech, double v_f) const {
    Flow flow;
    flow.i_d = dd_ * psi_d - df_ * psi_f;
    flow.i_q = qq_ * psi_q;
    flow.i_f = ff_ * psi_f - 1.5 * df_ * psi_d;
    const double w = coupled_ ? p_ * w_mech : 0.0;
    flow.shaft_Nm = coupled_ ? 1.5 * p_ * (psi_d * flow.i_q - psi_q * flow.i_d) : 0.0;
    flow.d_psi_d = -R_ * flow.i_d + w * psi_q;
    flow.d_psi_q = -R_ * flow.i_q - w * psi_d;
    flow.d_psi_f = v_f - R_f_ * flow.i_f;
    return flow;
  }

 private:
  bool coupled_;
  double p_, L_, M_, L_f_, R_, R_f_, D_;
  double dd_, df_, ff_, qq_;  // inverse inductances, 1/H
};

}  // namespace imrig::plant
