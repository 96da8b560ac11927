#pragma once
// Saturation of the main flux, in the air gap of the T circuit:
//   i_m = psi_m/L_m + (1/L_sat - 1/L_m) h(|psi_m|) psi_m/|psi_m|,   L_sat = saturated_ratio L_m,
// h the two-slope curve of two_slope.h: incremental inductance L_m at no flux, L_sat far above the knee flux,
// where the straight line of the saturated iron, carried back, meets that of the air gap. The same in all
// directions; the gradient of an energy (magnetic_circuit.h). Neutral: saturated_ratio 1. Sources:
// the shape of measured no-load curves, knee near rated flux, ratio 0.1 to 0.3; Vas, Electrical Machines and
// Drives: A Space-Vector Theory Approach, 1992 (saturation of the main flux in space vectors).

#include "plant/effects/effect.h"

namespace imrig::plant {

class MagnetizingSaturation final : public Effect {
 public:
  // knee: Wb, peak flux linkage of a phase.
  explicit MagnetizingSaturation(const SaturationLaw& law) : law_(law) {}
  std::string name() const override { return "magnetizing_saturation"; }
  unsigned hooks() const override { return 0; }
  std::vector<Parameter> parameters() const override {
    return {{"saturated_ratio", "", law_.saturated_ratio},
            {"knee_Wb", "Wb", law_.knee},
            {"softness", "", law_.softness}};
  }
  void magnetics(MagneticLaws& laws) const override { laws.main = law_; }

 private:
  SaturationLaw law_;
};

}  // namespace imrig::plant
