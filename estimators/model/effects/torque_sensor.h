#pragma once
// The torque transducer is off by a factor or by a constant: T_measured = T (1 + gain) + offset.
// A gain is stray load loss where load and speed are the same everywhere, and an offset is friction as long
// as the shaft turns one way: never an explanation, and no fit follows it by itself; what it may do to
// friction and stray load loss widens their intervals.

#include "estimators/model/base_machine.h"
#include "estimators/model/effects/effect.h"

namespace imrig::est {

template <class T>
class TorqueSensor : public EffectLaw<T> {
 public:
  static constexpr EffectParameter kShared[] = {{"gain", "1", Role::kAmplitude, 0.0, -0.5, 0.5, 2e-3},
                                                {"offset_Nm", "Nm", Role::kAmplitude, 0.0, -1e4, 1e4, 0.02}};
  static constexpr std::size_t kForm0[] = {0, 1};
  static constexpr EffectForm kForms[] = {{"gain and offset", kForm0, false, false}};
  static constexpr EffectInfo kInfo = {
      .name = "torque_sensor",
      .sentence = "The torque transducer is off by a factor or a constant",
      .equation = "T_measured = T (1 + gain) + offset",
      .source = "sensor chain",
      .experiment = "dead weights on a lever; zero with the coupling open; both directions",
      .needs = Needs::kTorque,
      .forms = kForms,
      .shared = kShared,
      .correction = true};

  TorqueSensor(const T* p, const T*) : p_(p), active_(live(p, 2)) {}

  void measured_torque(T& torque) const {
    if (active_) torque = torque * (1.0 + p_[0]) + p_[1];
  }

 private:
  const T* p_;
  bool active_;
};

}  // namespace imrig::est
