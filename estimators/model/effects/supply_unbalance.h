#pragma once
// The voltage at the winding has a negative sequence that the given voltage has not (or the voltage channels
// have different gains): v = v_given + epsilon v_given*.

#include "estimators/model/base_machine.h"
#include "estimators/model/effects/effect.h"

namespace imrig::est {

template <class T>
class SupplyUnbalance : public EffectLaw<T> {
 public:
  static constexpr EffectParameter kShared[] = {{"real", "1", Role::kAmplitude, 0.0, -0.5, 0.5, 2e-3},
                                                {"imaginary", "1", Role::kAmplitude, 0.0, -0.5, 0.5, 2e-3}};
  static constexpr std::size_t kForm0[] = {0, 1};
  static constexpr EffectForm kForms[] = {{"negative sequence", kForm0, false, false}};
  static constexpr EffectInfo kInfo = {
      "supply_unbalance",
      "The winding sees a negative-sequence voltage that the voltage channels do not show",
      "v = v_given + epsilon v_given*",
      "IEC 60034-26",
      "swap phases: does the negative sequence follow the supply, the terminals or the sensors",
      Needs::kSeries,
      kForms,
      kShared};

  SupplyUnbalance(const T* p, const T*) : p_(p), active_(live(p, 2)) {}

  void voltage(Cx<T>& v, const Cx<T>&, const Instant& at) const {
    if (!active_) return;
    v = v + negative_sequence(Cx<T>(p_[0], p_[1]), v, at);
  }

 private:
  const T* p_;
  bool active_;
};

}  // namespace imrig::est
