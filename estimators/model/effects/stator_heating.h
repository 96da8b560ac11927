#pragma once
// Stator heating: R_s follows the winding's temperature, measured, or one value a record.
//   R_s (1 + per_K (T_stator - reference)) (1 + warmth)

#include "estimators/model/base_machine.h"
#include "estimators/model/effects/effect.h"
#include "estimators/model/effects/temperature_law.h"

namespace imrig::est {

template <class T>
class StatorHeating : public EffectLaw<T> {
 public:
  static constexpr EffectParameter kShared[] = {
      {"per_K", "1/K", Role::kAmplitude, 0.0, -0.02, 0.04, 2e-4},
      {"reference_C", "C", Role::kConstant, 25.0, -100.0, 500.0, 1.0}};
  static constexpr EffectParameter kLocal[] = {{"warmth", "1", Role::kAmplitude, 0.0, -0.5, 1.0, 0.03}};
  static constexpr std::size_t kForm0[] = {0};
  static constexpr EffectForm kForms[] = {{"by winding temperature", kForm0, false, false},
                                          {"by record", {}, true, false}};
  static constexpr EffectInfo kInfo = {
      "stator_heating",
      "The stator winding heats up: R_s changes with its temperature",
      "R_s = R_s0 (1 + per_K (T_stator - reference)), or a value of its own for each record",
      "IEC 60034-1 (copper: 1/(235 + T))",
      "DC resistance at several winding temperatures",
      Needs::kAnything,
      kForms,
      kShared,
      kLocal};

  StatorHeating(const T* p, const T* q) : p_(p), q_(q), active_(live(p, 1) || live(q, 1)) {}

  void stator_resistance(T& factor, const Instant& at) const {
    if (!active_) return;
    factor = factor * temperature_factor(p_, q_, at);
  }

 private:
  const T* p_;
  const T* q_;
  bool active_;
};

}  // namespace imrig::est
