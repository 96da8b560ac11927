#pragma once
// Gains of the current channels that differ from phase to phase: a, b and -(a + b) relative to their mean.
// i_measured = i + gamma i*, gamma = (g_a + a^2 g_b + a g_c)/3: a negative sequence that goes
// with the current. The common gain scales every impedance alike and can be had from an independent reference
// only, so it is no effect but an accuracy of the set.

#include "estimators/model/base_machine.h"
#include "estimators/model/effects/effect.h"

namespace imrig::est {

template <class T>
class CurrentGain : public EffectLaw<T> {
 public:
  static constexpr EffectParameter kShared[] = {{"phase_a", "1", Role::kAmplitude, 0.0, -0.5, 0.5, 2e-3},
                                                {"phase_b", "1", Role::kAmplitude, 0.0, -0.5, 0.5, 2e-3}};
  static constexpr std::size_t kForm0[] = {0, 1};
  static constexpr EffectForm kForms[] = {{"mismatch", kForm0, false, false}};
  static constexpr EffectInfo kInfo = {
      "current_gain",
      "The current channels have different gains: twice the supply's frequency in the turning frame",
      "i_x,measured = (1 + g_x) i_x",
      "sensor chain",
      "swap sensors: a gain error follows the sensor, an unbalance does not",
      Needs::kSeries,
      kForms,
      kShared};

  CurrentGain(const T* p, const T*) : p_(p), active_(live(p, 2)) {}

  void measured_current(Cx<T>& i, const Instant& at) const {
    if (!active_) return;
    // (g_a + a^2 g_b + a g_c) / 3
    const T c = -(p_[0] + p_[1]);
    const Cx<T> gamma((p_[0] - 0.5 * (p_[1] + c)) * (1.0 / 3.0), (c - p_[1]) * (0.86602540378443865 / 3.0));
    i = i + negative_sequence(gamma, i, at);
  }

 private:
  const T* p_;
  bool active_;
};

}  // namespace imrig::est
