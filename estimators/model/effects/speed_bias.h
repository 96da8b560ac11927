#pragma once
// The speed channel is wrong by a factor (lines per turn, sample clock) or by a constant.
//   w = w_measured (1 + gain) + offset

#include "estimators/model/base_machine.h"
#include "estimators/model/effects/effect.h"

namespace imrig::est {

template <class T>
class SpeedBias : public EffectLaw<T> {
 public:
  static constexpr EffectParameter kShared[] = {
      {"gain", "1", Role::kAmplitude, 0.0, -0.05, 0.05, 2e-4},
      {"offset_rad_s", "rad/s", Role::kAmplitude, 0.0, -20.0, 20.0, 0.05}};
  static constexpr std::size_t kForm0[] = {0};
  static constexpr std::size_t kForm1[] = {1};
  static constexpr EffectForm kForms[] = {{"gain", kForm0, false, false}, {"offset", kForm1, false, false}};
  static constexpr EffectInfo kInfo = {"speed_bias",
                                       "The speed channel is biased: the slip is wrong, and R_r with it",
                                       "w_r = w_measured (1 + gain) + offset (electrical)",
                                       "sensor chain",
                                       "second speed reference; slip of the unloaded motor",
                                       Needs::kAnything,
                                       kForms,
                                       kShared};

  SpeedBias(const T* p, const T*) : p_(p), active_(live(p, 2)) {}

  void speed(T& w_r) const {
    if (active_) w_r = w_r * (1.0 + p_[0]) + p_[1];
  }

 private:
  const T* p_;
  bool active_;
};

}  // namespace imrig::est
