#pragma once
// Currents of the magnetic circuit from its fluxes, saturation included: gradients of one energy, so that
// nothing is made or lost on a round trip. Beside the linear circuit each saturating branch sees a fixed
// combination of psi_s and psi_r:
//   main      psi_x = place psi_r + (1 - place) psi_s            i_x = g(|psi_x|) psi_x / L_m
//   leakage   psi_y = psi_s - w psi_r,  w = 1 + rotor_share L_l/L_m     i_y = g(|psi_y|) psi_y / (w L_l)
// This is exact where one branch saturates by itself. rotor_share = 0: the stator's leakage, which carries
// the stator current as the whole leakage of the inverse-gamma circuit does; 1: all leakage behind the main
// flux, which carries the rotor current; between them both sides saturate (t_circuit.h).

#include "estimators/model/base_machine.h"
#include "estimators/model/effects/effect.h"
#include "estimators/model/effects/t_circuit.h"

namespace imrig::est {

template <class T>
class SaturatedIron {
 public:
  SaturatedIron(const MachineParameters<T>& base, const IronBends<T>& bends)
      : inverse_leakage_(1.0 / base.L_l),
        inverse_magnetizing_(1.0 / base.L_m),
        main_live_(bends.main_live),
        leakage_live_(bends.leakage_live),
        place_(bends.place),
        leakage_weight_(1.0 + bends.rotor_share * base.L_l / base.L_m) {
    if (main_live_) main_ = bends.main.curve();
    if (leakage_live_) {
      auto law = bends.leakage;
      law.psi_ref_Wb = law.psi_ref_Wb * leakage_weight_;  // at the same current
      leakage_ = law.curve();
    }
    const double share = value_of(bends.rotor_share);
    both_sides_ = leakage_live_ && share > 0.0 && share < 1.0;
    if (both_sides_) t_circuit_ = TCircuit<T>(base, bends);
  }

  // A; psi_s, psi_r in Wb.
  Currents<T> currents(const Cx<T>& psi_s, const Cx<T>& psi_r) const {
    if (both_sides_) return t_circuit_.currents(psi_s, psi_r);
    Currents<T> i;
    i.stator = scaled(inverse_leakage_, psi_s - psi_r);
    i.rotor = i.stator - scaled(inverse_magnetizing_, psi_r);
    if (main_live_) {
      const Cx<T> psi = psi_r + scaled(1.0 - place_, psi_s - psi_r);
      const Cx<T> extra = scaled(main_.share(psi) * inverse_magnetizing_, psi);
      i.stator = i.stator + scaled(1.0 - place_, extra);
      i.rotor = i.rotor - scaled(place_, extra);
    }
    if (leakage_live_) {
      const Cx<T> psi = psi_s - scaled(leakage_weight_, psi_r);
      const Cx<T> extra = scaled(leakage_.share(psi) * inverse_leakage_ / leakage_weight_, psi);
      i.stator = i.stator + extra;
      i.rotor = i.rotor + scaled(leakage_weight_, extra);
    }
    return i;
  }

 private:
  T inverse_leakage_, inverse_magnetizing_;
  bool main_live_, leakage_live_, both_sides_ = false;
  T place_, leakage_weight_;
  SaturationCurve<T> main_, leakage_;
  TCircuit<T> t_circuit_;
};

}  // namespace imrig::est
