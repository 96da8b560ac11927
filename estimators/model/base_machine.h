#pragma once
// The base machine: inverse-gamma circuit with flux states, per phase of the equivalent star, in a frame that
// turns with w_k.
//   i_s = (psi_s - psi_r) / L_l
//   dpsi_s/dt = v - R_s i_s - j w_k psi_s
//   dpsi_r/dt = R_r (i_s - psi_r / L_m) + j (w_r - w_k) psi_r
//   T_e = (3/2) n_p Im(psi_s* i_s)
// Space vectors are amplitude-invariant (peak); w_r and w_k are electrical. Linear iron, no iron loss,
// sinusoidal field, constant parameters within a record. Source: Proca and Keyhani 2002, (2) with its sign
// corrected; flux form of Slemon 1989. The scalar T is double or ceres::Jet, so derivatives with respect to
// the parameters are exact.

#include <cmath>

#include "estimators/model/complex_pair.h"

namespace imrig::est {

// Parameters of the circuit: ohm, ohm, H, H.
template <class T>
struct MachineParameters {
  T R_s{};
  T R_r{};
  T L_l{};
  T L_m{};
};

// State: flux linkages, Wb.
template <class T>
struct FluxState {
  Cx<T> psi_s;
  Cx<T> psi_r;
};

// What a simulation needs of a machine: State, current, derivative, rate. Effects will wrap it.
template <class T>
class BaseMachine {
 public:
  using Scalar = T;
  using State = FluxState<T>;

  explicit BaseMachine(const MachineParameters<T>& p)
      : p_(p), inverse_leakage_(T(1.0) / p.L_l), rotor_rate_(p.R_r / p.L_m) {}

  const MachineParameters<T>& parameters() const { return p_; }

  // A, from Wb.
  Cx<T> current(const State& x) const { return scaled(inverse_leakage_, x.psi_s - x.psi_r); }

  // Wb/s, from the frame's voltage (V), electrical rotor speed and frame speed (rad/s).
  State derivative(const State& x, std::complex<double> v, double w_r, double w_k) const {
    const Cx<T> i = current(x);
    const double slip = w_r - w_k;
    State d;
    d.psi_s = {v.real() - p_.R_s * i.re + w_k * x.psi_s.im, v.imag() - p_.R_s * i.im - w_k * x.psi_s.re};
    d.psi_r = {p_.R_r * i.re - rotor_rate_ * x.psi_r.re - slip * x.psi_r.im,
               p_.R_r * i.im - rotor_rate_ * x.psi_r.im + slip * x.psi_r.re};
    return d;
  }

 private:
  MachineParameters<T> p_;
  T inverse_leakage_;
  T rotor_rate_;
};

// N m, air gap.
template <class T>
T airgap_torque_Nm(int pole_pairs, const Cx<T>& psi_s, const Cx<T>& i_s) {
  return (1.5 * pole_pairs) * (psi_s.re * i_s.im - psi_s.im * i_s.re);
}

}  // namespace imrig::est
