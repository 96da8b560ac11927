#pragma once
// The speed channel is wrong by a factor (lines per turn, sample clock) or by a constant.
//   w = w_measured (1 + gain) + offset
// A speed that was rounded (rig/data/speed_rounding.h) is off by a constant of each record, which is no fault
// that could be claimed but free in every fit by up to half a step: `rounding`, in sigmas of a rounded value.

#include "estimators/model/base_machine.h"
#include "estimators/model/effects/effect.h"

namespace imrig::est {

template <class T>
class SpeedBias : public EffectLaw<T> {
 public:
  static constexpr EffectParameter kShared[] = {
      {"gain", "1", Role::kAmplitude, 0.0, -0.05, 0.05, 2e-4},
      {"offset_rad_s", "rad/s", Role::kAmplitude, 0.0, -20.0, 20.0, 0.05}};
  static constexpr EffectParameter kLocal[] = {
      {"rounding", "1", Role::kAmplitude, 0.0, -1.7320508, 1.7320508, 1.0}};
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
                                       kShared,
                                       kLocal};

  SpeedBias(const T* p, const T* q) : p_(p), q_(q), active_(live(p, 2)), rounded_(live(q, 1)) {}

  void speed(T& w_r, const Instant& at) const {
    if (active_) w_r = w_r * (1.0 + p_[0]) + p_[1];
    if (rounded_) w_r += at.speed_sigma * q_[0];
  }

 private:
  const T* p_;
  const T* q_;
  bool active_, rounded_;
};

}  // namespace imrig::est
