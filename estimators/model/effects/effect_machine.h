#pragma once
// The base machine with every effect of the library, each at its neutral value unless its parameters say
// otherwise. In a frame that turns with w_k (base_machine.h), with the hooks of effect.h:
//   i_s, i_r = gradients of the magnetic energy in (psi_s, psi_r)
//   e_s = v - R_s (f_s i + a_s),  i = i_s + G_s e_s                     iron at the stator flux
//   dpsi_s/dt = e_s - j w_k psi_s
//   i_r' = (i_r - j w_r G_r psi_r) / (1 + G_r R_r)                      iron at the rotor flux
//   dpsi_r/dt = R_r (f_r (1 + rise) (i_r' - i_b) + a_r) + j (w_r - w_k) psi_r
//   di_b/dt = corner (rise i_r' - (1 + rise) i_b) + j (w_r - w_k) i_b   the bar's deep layer
//   T_e = (3/2) n_p Im(psi_r* i_r')
// Amplitude-invariant vectors, peak values; i is what flows in at the terminals.

#include <algorithm>

#include "estimators/model/effects/effect_list.h"
#include "estimators/model/effects/saturated_iron.h"

namespace imrig::est {

template <class T>
struct EffectState {
  Cx<T> psi_s, psi_r;  // Wb
  Cx<T> i_b;           // A
};

template <class T>
class EffectMachine {
 public:
  using Scalar = T;
  using State = EffectState<T>;

  EffectMachine(const SharedVector<T>& shared, const LocalVector<T>& local)
      : shared_(shared),
        local_(local),
        base_{shared_[0], shared_[1], shared_[2], shared_[3]},
        laws_(make(std::make_index_sequence<kEffects>())),
        iron_(base_, bends()) {
    each([&](const auto& law) { law.layer(rise_, corner_); });
    // A current that a record began with decays whatever the rise: nothing jumps where the rise reaches zero.
    layered_ = live(&rise_, 1) || live(local_.data() + 4, 2);
  }
  EffectMachine(const EffectMachine&) = delete;
  EffectMachine& operator=(const EffectMachine&) = delete;

  const MachineParameters<T>& base() const { return base_; }

  State initial() const { return {{local_[0], local_[1]}, {local_[2], local_[3]}, {local_[4], local_[5]}}; }

  // Whether the bar's deep layer carries a current.
  bool layered() const { return layered_; }
  T layer_rate() const { return corner_ * (1.0 + rise_); }  // rad/s

  // Everything that follows from a state and its inputs at one instant.
  struct Inside {
    T w_r{};
    Cx<T> i;        // terminals, A
    Cx<T> e_s;      // dpsi_s/dt in the stationary frame, V
    Cx<T> i_rotor;  // into the cage, A
    T R_s{};        // ohm, as warm as it is
    T iron_at_stator{};  // 1/ohm
  };

  Inside inside(const State& x, std::complex<double> v_given, double w_r, const Instant& at) const {
    Inside out;
    out.w_r = T(w_r);
    each([&](const auto& law) { law.speed(out.w_r, at); });
    const Currents<T> i = iron_.currents(x.psi_s, x.psi_r);
    Iron<T> iron;
    Cx<T> v(v_given);
    T stator(1.0);
    Cx<T> asymmetry;
    each([&](const auto& law) {
      law.iron(iron, at);
      law.stator_resistance(stator, at);
    });
    each([&](const auto& law) {
      law.voltage(v, i.stator, at);
      law.stator_asymmetry(asymmetry, i.stator, at);
    });
    const T R_s = base_.R_s * stator;
    out.R_s = R_s;
    out.iron_at_stator = iron.at_stator;
    v = v - scaled(base_.R_s, asymmetry);
    out.i = scaled(1.0 / (1.0 + iron.at_stator * R_s), i.stator + scaled(iron.at_stator, v));
    out.e_s = v - scaled(R_s, out.i);
    out.i_rotor =
        scaled(1.0 / (1.0 + iron.at_rotor * base_.R_r), i.rotor - turned(iron.at_rotor * out.w_r, x.psi_r));
    return out;
  }

  State derivative(const State& x, std::complex<double> v, double w_r, const Instant& at) const {
    return derivative(x, inside(x, v, w_r, at), at);
  }

  State derivative(const State& x, const Inside& in, const Instant& at) const {
    T warm(1.0);
    Cx<T> asymmetry;
    each([&](const auto& law) {
      law.rotor_resistance(warm, at);
      law.rotor_asymmetry(asymmetry, in.i_rotor, at);
    });
    T rotor = warm;
    const T slip = in.w_r - at.w_k;
    each([&](const auto& law) { law.skin(rotor, x.psi_r, in.i_rotor, slip); });
    State d;
    d.psi_s = in.e_s - turned(at.w_k, x.psi_s);
    Cx<T> carried = in.i_rotor;
    if (layered_) {
      carried = scaled(1.0 + rise_, in.i_rotor - x.i_b);
      // A warm bar's resistance over the slot's leakage: its layers settle the quicker.
      d.i_b = scaled(corner_ * warm, scaled(rise_, in.i_rotor) - scaled(1.0 + rise_, x.i_b)) + turned(slip, x.i_b);
    }
    d.psi_r = scaled(base_.R_r * rotor, carried) + scaled(base_.R_r, asymmetry) + turned(slip, x.psi_r);
    return d;
  }

  // A, in the frame, as the sensors show it.
  Cx<T> measured_current(const Inside& in, const Instant& at) const {
    Cx<T> i = in.i;
    each([&](const auto& law) { law.measured_current(i, at); });
    return i;
  }

  // N m; w_r electrical.
  T shaft_torque_Nm(const Inside& in, const State& x, int pole_pairs) const {
    return airgap_torque_Nm(in, x, pole_pairs) - lost_torque_Nm(in, pole_pairs);
  }
  T airgap_torque_Nm(const Inside& in, const State& x, int pole_pairs) const {
    return (1.5 * pole_pairs) * (x.psi_r.re * in.i_rotor.im - x.psi_r.im * in.i_rotor.re);
  }
  T lost_torque_Nm(const Inside& in, int pole_pairs) const {
    T lost(0.0);
    const T w_M = in.w_r * (1.0 / pole_pairs);
    each([&](const auto& law) { law.lost_torque(lost, w_M, in.i_rotor, in.i); });
    return lost;
  }

  // What the air-gap torque gains where the terminals' current is off by `off` from the model's, at the
  // measured voltage: the flux moves by what R_s drops, slowly.
  T torque_beside_Nm(const Inside& in, const State& x, const Cx<T>& off, double w_k, int pole_pairs) const {
    const Cx<T> flux = x.psi_s + turned(in.R_s * (1.0 / w_k), off);
    const Cx<T> winding = in.i - scaled(in.iron_at_stator, in.e_s);
    const Cx<T> beside = winding + scaled(1.0 + in.iron_at_stator * in.R_s, off);
    return (1.5 * pole_pairs) * ((flux.re * beside.im - flux.im * beside.re) -
                                 (x.psi_s.re * winding.im - x.psi_s.im * winding.re));
  }

  // N m, as the transducer shows it.
  T measured_torque_Nm(T torque) const {
    each([&](const auto& law) { law.measured_torque(torque); });
    return torque;
  }

 private:
  template <std::size_t... K>
  EffectLaws<T> make(std::index_sequence<K...>) const {
    return EffectLaws<T>(std::tuple_element_t<K, EffectLaws<T>>(shared_.data() + kSharedPlace[K],
                                                                local_.data() + kLocalPlace[K])...);
  }
  IronBends<T> bends() const {
    IronBends<T> out;
    each([&](const auto& law) { law.bend(out); });
    return out;
  }
  template <class Visit>
  void each(Visit&& visit) const {
    std::apply([&](const auto&... law) { (visit(law), ...); }, laws_);
  }

  SharedVector<T> shared_;
  LocalVector<T> local_;
  MachineParameters<T> base_;
  EffectLaws<T> laws_;
  SaturatedIron<T> iron_;
  T rise_{};
  T corner_{};
  bool layered_ = false;
};

}  // namespace imrig::est
