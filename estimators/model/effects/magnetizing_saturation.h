#pragma once
// Main-flux saturation: the iron takes more than its linear current (saturation_law.h). place = 1 is
// saturation by the rotor flux (Proca and Keyhani 2002), 0 by the stator flux, between them by the air-gap
// flux of a T circuit: its saturating branch sees a fixed combination of psi_s and psi_r, so every split of
// the leakage is covered (saturated_iron.h).

#include "estimators/model/effects/effect.h"

namespace imrig::est {

template <class T>
class MagnetizingSaturation : public EffectLaw<T> {
 public:
  static constexpr double kExponents[] = {3.0, 6.0, 10.0};
  static constexpr double kPlaces[] = {1.0, 0.5, 0.0};
  static constexpr EffectParameter kShared[] = {
      {"extra", "1", Role::kAmplitude, 0.0, 0.0, 20.0, 0.02},
      {"exponent", "1", Role::kShape, 6.0, 1.0, 16.0, 1.0, kExponents},
      {"place", "1", Role::kShape, 0.5, 0.0, 1.0, 0.2, kPlaces},
      {"bend", "1", Role::kShape, 0.0, 0.1, 10.0, 0.2, {}, false, 1.0},
      {"onset", "1", Role::kShape, 0.0, 0.01, 0.99, 0.1, {}, false, 0.15},
      {"psi_ref_Wb", "Wb", Role::kConstant, 0.5, 1e-6, 1e6, 0.1}};
  static constexpr std::size_t kForm0[] = {0, 1};
  static constexpr std::size_t kForm1[] = {0, 1, 2};
  static constexpr std::size_t kForm2[] = {0, 1, 2, 3};
  static constexpr std::size_t kForm3[] = {0, 1, 2, 3, 4};
  static constexpr EffectForm kForms[] = {{"power law", kForm0, false, false},
                                          {"power law, placed", kForm1, false, true},
                                          {"two slopes, placed", kForm2, false, true},
                                          {"two slopes, placed, early onset", kForm3, false, true}};
  static constexpr EffectInfo kInfo = {
      "magnetizing_saturation",
      "The iron of the main flux saturates: the magnetizing current grows faster than the flux",
      "i_m = psi (1 + extra s(u)/s(1)) / L_m, u = |psi|/psi_ref; s = u^n, or with a bend 1 - (1 + (bend "
      "u)^n)^(-1/n), the onset's part with n = 2",
      "Levi 1995, IEEE Trans. Energy Conversion; Proca and Keyhani 2002 (L_m against I_d)",
      "no-load voltage sweep, 20 to 120 % of rated flux at one frequency",
      Needs::kAnything,
      kForms,
      kShared};

  MagnetizingSaturation(const T* p, const T*) : p_(p), active_(live(p, 1)) {}

  void bend(IronBends<T>& bends) const {
    bends.main = {p_[0], p_[1], p_[3], p_[5], p_[4]};
    bends.place = p_[2];
    bends.main_live = active_;
  }

 private:
  const T* p_;
  bool active_;
};

}  // namespace imrig::est
