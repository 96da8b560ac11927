#pragma once
// Stator winding with unequal phases: drop R_s (i + delta i*), delta = (d_a + a d_b + a2 d_c)/3 of the
// phases' relative deviations; bad joints and shorted turns.

#include "estimators/model/base_machine.h"
#include "estimators/model/effects/effect.h"

namespace imrig::est {

template <class T>
class StatorUnbalance : public EffectLaw<T> {
 public:
  static constexpr EffectParameter kShared[] = {{"real", "1", Role::kAmplitude, 0.0, -1.0, 1.0, 5e-3},
                                                {"imaginary", "1", Role::kAmplitude, 0.0, -1.0, 1.0, 5e-3}};
  static constexpr std::size_t kForm0[] = {0, 1};
  static constexpr EffectForm kForms[] = {{"resistance", kForm0, false, false}};
  static constexpr EffectInfo kInfo = {
      "stator_unbalance",
      "The stator phases have unequal resistance: a negative sequence that goes with the current",
      "v = R_s (i + delta i*) + dpsi/dt",
      "Tallam, Habetler and Harley 2002, IEEE Trans. Industry Applications",
      "swap phases: it stays with the terminals; DC resistance of each pair",
      Needs::kSeries,
      kForms,
      kShared};

  StatorUnbalance(const T* p, const T*) : p_(p), active_(live(p, 2)) {}

  void stator_asymmetry(Cx<T>& extra, const Cx<T>& i, const Instant& at) const {
    if (!active_) return;
    extra = extra + negative_sequence(Cx<T>(p_[0], p_[1]), i, at);
  }

 private:
  const T* p_;
  bool active_;
};

}  // namespace imrig::est
