#pragma once
// Stray load loss: torque that the rotor current costs beyond the circuit's own losses,
//   T = drag |i_r|^2 sgn(w_M), so P = drag |i_r|^2 |w_M|, with |i_r| peak.
// IEC 60034-2-1 fits it as P proportional to T^2. Seen only where shaft torque or shaft power is measured.

#include "estimators/model/base_machine.h"
#include "estimators/model/effects/effect.h"

namespace imrig::est {

template <class T>
class StrayLoadLoss : public EffectLaw<T> {
 public:
  static constexpr EffectParameter kShared[] = {
      {"drag_Nm_per_A2", "Nm/A^2", Role::kAmplitude, 0.0, 0.0, 10.0, 1e-4}};
  static constexpr std::size_t kForm0[] = {0};
  static constexpr EffectForm kForms[] = {{"drag", kForm0, false, false}};
  static constexpr EffectInfo kInfo = {
      "stray_load_loss",
      "Under load the machine loses more than its resistances, its iron and its bearings take",
      "T_lost = drag |i_r|^2",
      "IEC 60034-2-1 (additional load losses from P(T^2)); IEEE 112 method B",
      "temperature-corrected regression of the residual loss on T^2",
      Needs::kTorque,
      kForms,
      kShared};

  StrayLoadLoss(const T* p, const T*) : p_(p), active_(live(p, 1)) {}

  void lost_torque(T& torque, const T& w_M, const Cx<T>& i_r) const {
    if (!active_) return;
    const double w = value_of(w_M);
    const double sign = w > 0.1 ? 1.0 : w < -0.1 ? -1.0 : 10.0 * w;
    torque = torque + p_[0] * sign * norm(i_r);
  }

 private:
  const T* p_;
  bool active_;
};

}  // namespace imrig::est
