#pragma once
// The load: a round-rotor synchronous generator with field winding on a resistor box, dq model in the rotor's
// frame (motor signs, peak values):
//   psi_d = L i_d + M i_f,   psi_q = L i_q,   psi_f = L_f i_f + (3/2) M i_d,
//   d psi_d/dt = -R i_d + w psi_q,   d psi_q/dt = -R i_q - w psi_d,   d psi_f/dt = v_f - R_f i_f,
// R = R_a + R_load, w = p w_mech. Torque on the shaft (3/2) p (psi_d i_q - psi_q i_d), negative where it
// generates; steady state:
//   T = -(3/2) p w (M i_f)^2 R / (R^2 + (w L)^2).
// Saturation (saturated_ratio below 1) bends what the air-gap flux psi_m asks of both windings together; the
// leakages stay linear, L = L_l + L_m, n = M/L_m the turns of the field as the armature sees them:
//   i_d + n i_f = psi_md/L_m + x_d,   i_q = psi_mq/L_m + x_q,   x = h(|psi_m|) psi_m/|psi_m|,
//   psi_d = L_l i_d + psi_md,   psi_q = L_l i_q + psi_mq,   psi_f = (L_f - (3/2) n M) i_f + (3/2) n psi_md,
// h of two_slope.h: the open-circuit characteristic E = w psi_m against i_f = psi_m/M + h(psi_m)/n. One
// energy stands behind it, so none is made. Rotational losses brake the shaft: core loss
//   T = (P_c/w_0) (|psi_m|/psi_0)^2 [(1 - k) sgn w + k w/w_0],
// hysteresis and eddy shares, and friction T = c_0 sgn w + c_2 w |w|, sgn w = w/sqrt(w^2 + 0.04 rad^2/s^2).
// No dampers; an unexcited field is closed by the supply's freewheeling path. Sources: Krause, Wasynczuk,
// Sudhoff, Analysis of Electric Machinery, chapter 5, with L_d = L_q; Kundur, Power System Stability and
// Control, section 3.8 (saturation of the main flux alone, leakages linear); IEEE Std 115 (open-circuit
// characteristic; losses segregated into friction and windage, unexcited, and open-circuit core loss).

#include "plant/effects/two_slope.h"
#include "plant/plant_config.h"

namespace imrig::plant {

class Generator {
 public:
  struct Flow {
    double i_d = 0.0, i_q = 0.0, i_f = 0.0;  // A
    double shaft_Nm = 0.0;                   // on the shaft, positive drives; rotational losses included
    double core_W = 0.0, friction_W = 0.0;
    double d_psi_d = 0.0, d_psi_q = 0.0, d_psi_f = 0.0;
  };

  explicit Generator(const GeneratorConfig& config);

  Flow flow(double psi_d, double psi_q, double psi_f, double w_mech, double v_f) const {
    Flow out;
    flow(psi_d, psi_q, psi_f, w_mech, v_f, out);
    return out;
  }
  void flow(double psi_d, double psi_q, double psi_f, double w_mech, double v_f, Flow& flow) const {
    flow.core_W = flow.friction_W = 0.0;
    if (bend_.none()) {
      flow.i_d = dd_ * psi_d - df_ * psi_f;
      flow.i_q = qq_ * psi_q;
      flow.i_f = ff_ * psi_f - 1.5 * df_ * psi_d;
    } else {
      bent_currents(psi_d, psi_q, psi_f, flow);
    }
    const double w = coupled_ ? p_ * w_mech : 0.0;
    flow.shaft_Nm = coupled_ ? 1.5 * p_ * (psi_d * flow.i_q - psi_q * flow.i_d) : 0.0;
    if (brakes_) brake(psi_d, psi_q, w_mech, flow);
    flow.d_psi_d = -R_ * flow.i_d + w * psi_q;
    flow.d_psi_q = -R_ * flow.i_q - w * psi_d;
    flow.d_psi_f = v_f - R_f_ * flow.i_f;
  }

  // Magnetic energy at these fluxes and the currents that belong to them, J.
  double stored_J(double psi_d, double psi_q, double psi_f, const Flow& flow) const;
  // Field current, A, that holds this air-gap flux linkage with open terminals.
  double open_circuit_field_A(double psi_m_Wb) const;

 private:
  void bent_currents(double psi_d, double psi_q, double psi_f, Flow& flow) const;
  void brake(double psi_d, double psi_q, double w_mech, Flow& flow) const;

  GeneratorConfig config_;
  bool coupled_, brakes_;
  double p_, L_, M_, L_f_, R_, R_f_, D_;
  double dd_, df_, ff_, qq_;  // inverse inductances, 1/H
  // Of the bent circuit.
  double L_l_, L_m_, n_, L_fl_;
  TwoSlope bend_;
};

}  // namespace imrig::plant
