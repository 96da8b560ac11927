#pragma once
// Saturation of the leakage paths (tooth tips, closed rotor slots), stator and rotor each with its own
// current:
//   i = psi/L + (1/L_sat - 1/L) h(|psi|) psi/|psi|,   L_sat = saturated_ratio L, knee flux = L x knee
//   current,
// psi the leakage flux and L the leakage inductance of that side of the T circuit, h the two-slope curve of
// two_slope.h. The incremental leakage falls from L to L_sat around the knee current (peak). Neutral: both
// ratios 1. Source: Lipo and Consoli, Modeling and simulation of induction motors with saturable leakage
// reactances, IEEE Trans. Ind. Appl. 20(1), 1984: visible from about twice rated current, locked-rotor
// leakage 20 to 40 % lower.

#include "plant/effects/effect.h"

namespace imrig::plant {

class LeakageSaturation final : public Effect {
 public:
  // knee: A, peak.
  LeakageSaturation(const SaturationLaw& stator, const SaturationLaw& rotor)
      : stator_(stator), rotor_(rotor) {}
  std::string name() const override { return "leakage_saturation"; }
  unsigned hooks() const override { return 0; }
  std::vector<Parameter> parameters() const override {
    return {{"stator_saturated_ratio", "", stator_.saturated_ratio},
            {"stator_knee_A", "A", stator_.knee},
            {"rotor_saturated_ratio", "", rotor_.saturated_ratio},
            {"rotor_knee_A", "A", rotor_.knee},
            {"softness", "", stator_.softness}};
  }
  void magnetics(MagneticLaws& laws) const override {
    laws.stator_leakage = stator_, laws.rotor_leakage = rotor_;
  }

 private:
  SaturationLaw stator_, rotor_;
};

}  // namespace imrig::plant
