#pragma once
// The speed channel is wrong by a factor (lines per turn, sample clock), by a constant, or late (a filter, an
// encoder counted over a window: half of it).
//   w = w_measured (1 + gain) + offset + lag d/dt (w_measured + share lag dw_measured/dt)
// share is 0 behind a first-order filter, 1/3 behind a count over a window of twice the lag, 1/2 of a pure
// delay. A speed that was rounded (rig/data/speed_rounding.h) is off by a constant of each record, which is
// no fault that could be claimed but free in every fit by up to half a step: `rounding`, in sigmas of a
// rounded value.

#include "estimators/model/base_machine.h"
#include "estimators/model/effects/effect.h"

namespace imrig::est {

template <class T>
class SpeedBias : public EffectLaw<T> {
 public:
  static constexpr EffectParameter kShared[] = {
      {"gain", "1", Role::kAmplitude, 0.0, -0.05, 0.05, 2e-4},
      {"offset_rad_s", "rad/s", Role::kAmplitude, 0.0, -20.0, 20.0, 0.05},
      {"lag_s", "s", Role::kAmplitude, 0.0, -5e-3, 0.1, 2e-4},
      {"share", "1", Role::kShape, 0.0, -0.1, 0.6, 0.05}};
  static constexpr EffectParameter kLocal[] = {
      {"rounding", "1", Role::kAmplitude, 0.0, -1.7320508, 1.7320508, 1.0}};
  static constexpr std::size_t kForm0[] = {0};
  static constexpr std::size_t kForm1[] = {1};
  static constexpr std::size_t kForm2[] = {2};
  static constexpr std::size_t kForm3[] = {2, 3};
  static constexpr EffectForm kForms[] = {{"gain", kForm0, false, false},
                                          {"offset", kForm1, false, false},
                                          {"lag", kForm2, false, false},
                                          {"lag, with its second order", kForm3, false, true}};
  static constexpr EffectInfo kInfo = {
      "speed_bias",
      "The speed channel is biased or late: the slip is wrong, and R_r with it",
      "w_r = w_measured (1 + gain) + offset + lag d/dt (w_measured + share lag dw_measured/dt) (electrical)",
      "sensor chain",
      "second speed reference; slip of the unloaded motor",
      Needs::kAnything,
      kForms,
      kShared,
      kLocal};

  SpeedBias(const T* p, const T* q) : p_(p), q_(q), active_(live(p, 3)), rounded_(live(q, 1)) {}

  void speed(T& w_r, const Instant& at) const {
    if (active_) w_r = w_r * (1.0 + p_[0]) + p_[1] + p_[2] * (at.speed_rate + p_[3] * p_[2] * at.speed_bend);
    if (rounded_) w_r += at.speed_sigma * q_[0];
  }

 private:
  const T* p_;
  const T* q_;
  bool active_, rounded_;
};

}  // namespace imrig::est
