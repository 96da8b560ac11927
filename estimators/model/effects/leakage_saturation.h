#pragma once
// Leakage saturation: the tips of the teeth saturate with the current that passes them.
//   psi_y = psi_s - (1 + place L_l/L_m) psi_r,   i_y = g(|psi_y|) psi_y / L_l   (saturation_law.h)
// place = 0: the stator's leakage, which carries the stator current as the whole leakage of the inverse-gamma
// circuit does; place = 1: the rotor's (all leakage behind the main flux), which carries the rotor current.
// Added to the gradients of the energy.

#include "estimators/model/base_machine.h"
#include "estimators/model/effects/effect.h"
#include "estimators/model/effects/saturation_law.h"

namespace imrig::est {

template <class T>
class LeakageSaturation : public EffectLaw<T> {
 public:
  static constexpr double kExponents[] = {1.0, 2.0, 4.0};
  static constexpr double kPlaces[] = {0.0, 0.0, 1.0};
  static constexpr EffectParameter kShared[] = {
      {"extra", "1", Role::kAmplitude, 0.0, 0.0, 20.0, 0.02},
      {"exponent", "1", Role::kShape, 2.0, 0.5, 10.0, 1.0, kExponents},
      {"place", "1", Role::kShape, 0.0, 0.0, 1.0, 0.5, kPlaces},
      {"settling", "1", Role::kShape, 0.0, 0.0, 50.0, 0.5},
      {"psi_ref_Wb", "Wb", Role::kConstant, 0.1, 1e-6, 1e6, 0.1}};
  static constexpr std::size_t kForm0[] = {0, 1};
  static constexpr std::size_t kForm1[] = {0, 1, 3};
  static constexpr std::size_t kForm2[] = {0, 1, 2, 3};
  static constexpr EffectForm kForms[] = {{"power law", kForm0, false, false},
                                          {"settling law", kForm1, false, true},
                                          {"settling law, placed", kForm2, false, true}};
  static constexpr EffectInfo kInfo = {
      "leakage_saturation",
      "The leakage paths saturate: the leakage inductance falls at high current",
      "i = psi_l (1 + extra (|psi_l|/psi_ref)^n) / L_l",
      "Lipo and Consoli 1984, IEEE Trans. Industry Applications; Proca and Keyhani 2002 (L_l against I)",
      "locked-like test at one frequency with the current swept to several times rated",
      Needs::kAnything,
      kForms,
      kShared};

  LeakageSaturation(const T* p, const T*) : p_(p), active_(live(p, 1)) {}

  void magnetics(const MachineParameters<T>& base, const Cx<T>& psi_s, const Cx<T>& psi_r,
                 Currents<T>& i) const {
    if (!active_) return;
    const T weight = 1.0 + p_[2] * base.L_l / base.L_m;
    const Cx<T> psi = psi_s - scaled(weight, psi_r);
    const Cx<T> extra = scaled(saturation_share(psi, p_[0], p_[1], p_[3], p_[4]) / base.L_l, psi);
    i.stator = i.stator + extra;
    i.rotor = i.rotor + scaled(weight, extra);
  }

 private:
  const T* p_;
  bool active_;
};

}  // namespace imrig::est
