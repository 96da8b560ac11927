#pragma once
// Rotor skin effect (deep bar), in three forms.
// Line, the paper's (13): R_r(w_s) = R_1 + k6 |w_s| with the instantaneous slip frequency of the rotor flux,
// so R_r = R_1 / (1 - k6 |Im(psi_r* i_r)| / |psi_r|^2): no loop.
// The same line with the slip frequency of the supply, w_s = w_k - w_r, as simulations have it that do not
// follow the flux through a transient: R_r = R_1 (1 + per_rad_s |w_s|). Two layers: the top of the bar
// carries i_r - i_b, the bottom i_b behind the slot's leakage,
//   drop = R_r (1 + rise) (i_r - i_b),   di_b/dt = corner (rise i_r - (1 + rise) i_b)  in the rotor's frame
// which is R_r at standstill of the flux, R_r (1 + rise) far above the corner, and lowers the rotor's leakage
// with frequency as a deep bar does (Levy, Landy and McCulloch 1990). The corner is a resistance over a
// leakage, and rises with the temperature of the bar as R_r does.

#include <cmath>

#include "estimators/model/base_machine.h"
#include "estimators/model/effects/effect.h"

namespace imrig::est {

template <class T>
class RotorSkinEffect : public EffectLaw<T> {
 public:
  static constexpr double kCorners[] = {60.0, 200.0, 600.0};
  static constexpr EffectParameter kShared[] = {
      {"k6_ohm_s", "ohm s", Role::kAmplitude, 0.0, 0.0, 1.0, 2e-5},
      {"rise", "1", Role::kAmplitude, 0.0, 0.0, 20.0, 0.02},
      {"corner_rad_s", "rad/s", Role::kShape, 200.0, 5.0, 5000.0, 50.0, kCorners, true},
      {"per_rad_s", "s", Role::kAmplitude, 0.0, 0.0, 0.1, 5e-5}};
  static constexpr std::size_t kForm0[] = {0};
  static constexpr std::size_t kForm1[] = {1, 2};
  static constexpr std::size_t kForm2[] = {3};
  static constexpr EffectForm kForms[] = {{"line", kForm0, false, false},
                                          {"two layers", kForm1, false, false},
                                          {"line, by the supply's frequency", kForm2, false, false}};
  static constexpr EffectInfo kInfo = {
      "rotor_skin_effect",
      "The rotor current crowds into the top of the bars: R_r grows with slip frequency",
      "R_r(w_s) = R_1 + k6 w_s, or R_1 (1 + per_rad_s w_s) in the supply's slip frequency; two layers: R_r "
      "(1 + rise) far above the corner",
      "Proca and Keyhani 2002 (13); Levy, Landy and McCulloch 1990, IEE Proc. B (two layers)",
      "low-current locked-like frequency sweep at constant temperature",
      Needs::kAnything,
      kForms,
      kShared,
      {},
      "currents between the bars of a skewed cage, and a second cage"};

  RotorSkinEffect(const T* p, const T*) : p_(p), line_(live(p, 1)), steady_(live(p + 3, 1)) {}

  void skin(T& factor, const Cx<T>& psi_r, const Cx<T>& i_r, const T& slip) const {
    if (steady_) factor = factor * (1.0 + p_[3] * (value_of(slip) < 0.0 ? -slip : slip));
    if (!line_) return;
    const T cross = psi_r.re * i_r.im - psi_r.im * i_r.re;
    const T share = p_[0] * (value_of(cross) < 0.0 ? -cross : cross) / (norm(psi_r) + 1e-9);
    // A collapsing flux makes the slip frequency unbounded; the bar's resistance is not.
    factor = factor / (1.0 - (value_of(share) > kMostShare ? T(kMostShare) : share));
  }

  void layer(T& rise, T& corner) const {
    rise = p_[1];
    corner = p_[2];
  }

 private:
  static constexpr double kMostShare = 0.8;
  const T* p_;
  bool line_, steady_;
};

}  // namespace imrig::est
