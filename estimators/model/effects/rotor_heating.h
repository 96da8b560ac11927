#pragma once
// Rotor heating: R_r follows the temperature of the cage, which nobody measures.
//   R_r (1 + per_K (T_stator - reference)) (1 + warmth)
// T_stator: the measured winding temperature, a proxy where both move together; warmth: one value a record,
// estimated from the record itself like its initial flux, where they do not.

#include "estimators/model/base_machine.h"
#include "estimators/model/effects/effect.h"
#include "estimators/model/effects/temperature_law.h"

namespace imrig::est {

template <class T>
class RotorHeating : public EffectLaw<T> {
 public:
  static constexpr EffectParameter kShared[] = {
      {"per_K", "1/K", Role::kAmplitude, 0.0, -0.02, 0.04, 2e-4},
      {"reference_C", "C", Role::kConstant, 25.0, -100.0, 500.0, 1.0}};
  static constexpr EffectParameter kLocal[] = {{"warmth", "1", Role::kAmplitude, 0.0, -0.5, 1.0, 0.015}};
  static constexpr std::size_t kForm0[] = {0};
  static constexpr EffectForm kForms[] = {{"by winding temperature", kForm0, false, false},
                                          {"by record", {}, true, false}};
  static constexpr EffectInfo kInfo = {
      "rotor_heating",
      "The rotor cage heats up: R_r changes with temperature, hence with time and load history",
      "R_r = R_1 (1 + per_K (T_stator - reference)), or a value of its own for each record",
      "IEC 60034-2-1 (temperature coefficient); Proca and Keyhani 2002 (13)",
      "the same points cold and hot, in random order",
      Needs::kAnything,
      kForms,
      kShared,
      kLocal};

  RotorHeating(const T* p, const T* q) : p_(p), q_(q), active_(live(p, 1) || live(q, 1)) {}

  void rotor_resistance(T& factor, const Instant& at) const {
    if (!active_) return;
    factor = factor * temperature_factor(p_, q_, at);
  }

 private:
  const T* p_;
  const T* q_;
  bool active_;
};

}  // namespace imrig::est
