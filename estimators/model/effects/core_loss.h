#pragma once
// Core loss as conductances beside the EMF: eddy currents take a power that goes with w^2 psi^2 (a constant
// conductance), hysteresis one that goes with w psi^2 (a conductance that falls as 1/w).
//   G = eddy_S + hysteresis_S_rad_s / |w_k|,   place G at the rotor flux, (1 - place) G at the stator flux
// w_k: frequency of the supply. Proca and Keyhani 2002 (20) has one R_c = 1/G at the rotor flux.

#include <algorithm>
#include <cmath>

#include "estimators/model/base_machine.h"
#include "estimators/model/effects/effect.h"

namespace imrig::est {

template <class T>
class CoreLoss : public EffectLaw<T> {
 public:
  static constexpr double kPlaces[] = {1.0, 0.0, 0.5};
  static constexpr EffectParameter kShared[] = {
      {"eddy_S", "S", Role::kAmplitude, 0.0, 0.0, 10.0, 1e-4},
      {"hysteresis_S_rad_s", "S rad/s", Role::kAmplitude, 0.0, 0.0, 1e4, 0.04},
      {"place", "1", Role::kShape, 0.5, 0.0, 1.0, 0.5, kPlaces}};
  static constexpr std::size_t kForm0[] = {0};
  static constexpr std::size_t kForm1[] = {1};
  static constexpr std::size_t kForm2[] = {0, 1};
  static constexpr std::size_t kForm3[] = {0, 1, 2};
  static constexpr EffectForm kForms[] = {{"eddy currents", kForm0, false, false},
                                          {"hysteresis", kForm1, false, false},
                                          {"eddy currents and hysteresis", kForm2, false, false},
                                          {"eddy currents and hysteresis, placed", kForm3, false, true}};
  static constexpr EffectInfo kInfo = {
      "core_loss",
      "The iron takes active power that grows with flux and frequency",
      "P = (3/2) |E|^2 (eddy + hysteresis/w)",
      "Proca and Keyhani 2002 (20); Bertotti 1988, IEEE Trans. Magnetics (separation of losses)",
      "no-load points that vary reactive power at fixed frequency and flux; swap channels",
      Needs::kAnything,
      kForms,
      kShared};

  CoreLoss(const T* p, const T*) : p_(p), active_(live(p, 2)) {}

  void iron(Iron<T>& iron, const Instant& at) const {
    if (!active_) return;
    const T G = p_[0] + p_[1] * (1.0 / std::max(std::abs(at.w_k), kSlowest_rad_s));
    iron.at_rotor = iron.at_rotor + p_[2] * G;
    iron.at_stator = iron.at_stator + (1.0 - p_[2]) * G;
  }

 private:
  static constexpr double kSlowest_rad_s = 6.0;  // below 1 Hz there is no EMF to speak of
  const T* p_;
  bool active_;
};

}  // namespace imrig::est
