#pragma once
// Cross-saturation: the teeth carry the main flux and a share c of the stator's leakage flux, and what they
// need in excitation depends on both:
//   psi_t = psi_m + c (psi_s - psi_m),   i_t = (1/L_sat - 1/L_m) h(|psi_t|) psi_t/|psi_t|,
// L_sat = saturated_ratio L_m; i_t adds to the main path's current and, by the share c, to the stator's: the
// gradient of one energy term E_t(|psi_t|) (magnetic_circuit.h), so d psi_d/d i_q = d psi_q/d i_d. The torque
// current's leakage flux saturates the teeth and pulls the magnetizing current at fixed main flux, beyond
// what the isotropic main curve gives. c = 0 puts the teeth on the air-gap flux, c = 1 on the stator's whole
// flux. Adds to magnetizing_saturation, or acts alone. Neutral: saturated_ratio 1. Sources: Vas,
// Electrical Machines and Drives: A Space-Vector Theory Approach, 1992 (cross-saturation); that the teeth
// carry both fluxes is geometry.

#include "plant/effects/effect.h"

namespace imrig::plant {

class CrossSaturation final : public Effect {
 public:
  // knee: Wb, of the teeth's flux linkage.
  CrossSaturation(const SaturationLaw& teeth, double leakage_share)
      : teeth_(teeth), leakage_share_(leakage_share) {}
  std::string name() const override { return "cross_saturation"; }
  unsigned hooks() const override { return 0; }
  std::vector<Parameter> parameters() const override {
    return {{"saturated_ratio", "", teeth_.saturated_ratio},
            {"knee_Wb", "Wb", teeth_.knee},
            {"leakage_share", "", leakage_share_},
            {"softness", "", teeth_.softness}};
  }
  void magnetics(MagneticLaws& laws) const override {
    laws.teeth = teeth_, laws.leakage_in_teeth = leakage_share_;
  }

 private:
  SaturationLaw teeth_;
  double leakage_share_;
};

}  // namespace imrig::plant
