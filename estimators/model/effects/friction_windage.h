#pragma once
// Friction and windage: torque between the air gap and the shaft.
//   T = coulomb sgn(w_M) + viscous w_M + windage |w_M| w_M
// Seen only where shaft torque or shaft power is measured.

#include "estimators/model/base_machine.h"
#include "estimators/model/effects/effect.h"

namespace imrig::est {

template <class T>
class FrictionWindage : public EffectLaw<T> {
 public:
  static constexpr EffectParameter kShared[] = {
      {"coulomb_Nm", "Nm", Role::kAmplitude, 0.0, 0.0, 1e4, 0.02},
      {"viscous_Nms", "Nm s", Role::kAmplitude, 0.0, 0.0, 1e3, 1e-4},
      {"windage_Nms2", "Nm s^2", Role::kAmplitude, 0.0, 0.0, 1e2, 1e-6}};
  static constexpr std::size_t kForm0[] = {0};
  static constexpr std::size_t kForm1[] = {1};
  static constexpr std::size_t kForm2[] = {2};
  static constexpr std::size_t kForm3[] = {0, 1, 2};
  static constexpr EffectForm kForms[] = {{"Coulomb", kForm0, false, false},
                                          {"viscous", kForm1, false, false},
                                          {"windage", kForm2, false, false},
                                          {"Coulomb, viscous and windage", kForm3, false, true}};
  static constexpr EffectInfo kInfo = {
      "friction_windage",
      "Bearings and fan take torque between the air gap and the shaft",
      "T = c_0 sgn(w) + c_1 w + c_2 |w| w",
      "IEC 60034-2-1, no-load test extrapolated to zero voltage",
      "no-load voltage sweep down to low flux, both directions, or a coast-down",
      Needs::kTorque,
      kForms,
      kShared};

  FrictionWindage(const T* p, const T*) : p_(p), active_(live(p, 3)) {}

  void lost_torque(T& torque, const T& w_M, const Cx<T>&, const Cx<T>&) const {
    if (!active_) return;
    const double w = value_of(w_M);
    const double sign = w > kRest_rad_s ? 1.0 : w < -kRest_rad_s ? -1.0 : w / kRest_rad_s;
    torque = torque + (p_[0] * sign + w_M * (p_[1] + p_[2] * (w < 0.0 ? -w_M : w_M)));
  }

 private:
  static constexpr double kRest_rad_s = 0.1;
  const T* p_;
  bool active_;
};

}  // namespace imrig::est
