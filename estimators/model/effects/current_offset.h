#pragma once
// Offset of the current channels: a constant vector in the stationary frame, one for the data set.

#include "estimators/model/base_machine.h"
#include "estimators/model/effects/effect.h"

namespace imrig::est {

template <class T>
class CurrentOffset : public EffectLaw<T> {
 public:
  static constexpr EffectParameter kShared[] = {{"alpha_A", "A", Role::kAmplitude, 0.0, -1e3, 1e3, 0.01},
                                                {"beta_A", "A", Role::kAmplitude, 0.0, -1e3, 1e3, 0.01}};
  static constexpr std::size_t kForm0[] = {0, 1};
  static constexpr EffectForm kForms[] = {{"offset", kForm0, false, false}};
  static constexpr EffectInfo kInfo = {
      "current_offset",
      "The current channels have an offset: a line at the supply's frequency in the turning frame",
      "i_measured = i + i_0",
      "sensor chain",
      "reading at zero current; swap sensors",
      Needs::kSeries,
      kForms,
      kShared};

  CurrentOffset(const T* p, const T*) : p_(p), active_(live(p, 2)) {}

  void measured_current(Cx<T>& i, const Instant& at) const {
    if (!active_) return;
    const Cx<T> back(T(at.turn.real()), T(-at.turn.imag()));
    i = i + Cx<T>(p_[0], p_[1]) * back;
  }

 private:
  const T* p_;
  bool active_;
};

}  // namespace imrig::est
