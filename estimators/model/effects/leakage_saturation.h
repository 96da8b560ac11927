#pragma once
// Leakage saturation: the tips of the teeth saturate with the current that passes them. The law is
// saturation_law.h, where it sits in the circuit saturated_iron.h.

#include "estimators/model/effects/effect.h"

namespace imrig::est {

template <class T>
class LeakageSaturation : public EffectLaw<T> {
 public:
  static constexpr double kExponents[] = {1.0, 2.0, 4.0};
  static constexpr double kSides[] = {0.0, 0.0, 1.0};
  static constexpr EffectParameter kShared[] = {
      {"extra", "1", Role::kAmplitude, 0.0, 0.0, 20.0, 0.02},
      {"exponent", "1", Role::kShape, 2.0, 0.5, 10.0, 1.0, kExponents},
      {"rotor_share", "1", Role::kShape, 0.0, 0.01, 0.99, 0.5, kSides, false, 0.5},
      {"bend", "1", Role::kShape, 0.0, 0.1, 10.0, 0.2, {}, false, 1.0},
      {"onset", "1", Role::kShape, 0.0, 0.01, 0.99, 0.1, {}, false, 0.15},
      {"psi_ref_Wb", "Wb", Role::kConstant, 0.1, 1e-6, 1e6, 0.1}};
  static constexpr std::size_t kForm0[] = {0, 1};
  static constexpr std::size_t kForm1[] = {0, 1, 3};
  static constexpr std::size_t kForm2[] = {0, 1, 2, 3};
  static constexpr std::size_t kForm3[] = {0, 1, 2, 3, 4};
  static constexpr EffectForm kForms[] = {{"power law", kForm0, false, false},
                                          {"two slopes", kForm1, false, true},
                                          {"two slopes, both sides", kForm2, false, true},
                                          {"two slopes, both sides, early onset", kForm3, false, true}};
  static constexpr EffectInfo kInfo = {
      "leakage_saturation",
      "The leakage paths saturate: the leakage inductance falls at high current",
      "i = psi_l (1 + extra s(u)/s(1)) / L_l, u = |psi_l|/psi_ref; s = u^n, or with a bend 1 - (1 + (bend "
      "u)^n)^(-1/n), the onset's part with n = 2; rotor_share of L_l on the rotor's side",
      "Lipo and Consoli 1984, IEEE Trans. Industry Applications; Proca and Keyhani 2002 (L_l against I)",
      "locked-like test at one frequency with the current swept to several times rated",
      Needs::kAnything,
      kForms,
      kShared};

  LeakageSaturation(const T* p, const T*) : p_(p), active_(live(p, 1)) {}

  void bend(IronBends<T>& bends) const {
    bends.leakage = {p_[0], p_[1], p_[3], p_[5], p_[4]};
    bends.rotor_share = p_[2];
    bends.leakage_live = active_;
  }

 private:
  const T* p_;
  bool active_;
};

}  // namespace imrig::est
