#pragma once
// An inter-turn short: the share mu of one phase's turns is closed by a resistance R_f, and a current i_f
// circulates in it. Phases in terms of turns, rotor and mutual flux seen by the ampere-turns i_a - mu i_f,
// leakage and resistance of the shorted turns mu times the phase's:
//   v_a = R_s (i_a - mu i_f) + d psi_a/dt,   R_f i_f = mu R_s (i_a - i_f) + d psi_short/dt,
//   psi_short = mu [L_ls (i_a - i_f) + L_m (i_alpha - (2/3) mu i_f + i_r,alpha)].
// In the current of the healthy winding, i' = i_s - (2/3) mu i_f e (e the phase's axis), the first is the
// healthy machine's equation, and what is left of the second is a coil across the terminals:
//   mu (1 - 2 mu/3) L_ls d i_f/dt = mu (v_s . e) - [R_f + mu (1 - 2 mu/3) R_s] i_f.
// So the terminals carry (2/3) mu i_f e on top of the healthy current: a negative sequence at any load, and
// more heat in the winding than either tells alone. Without L_ls it is the resistive dipole of Bachir et al.
// One phase at a time; no third harmonic of the shorted coil's field. Sources: Tallam, Habetler, Harley,
// Transient model for induction machines with stator winding turn faults, IEEE Trans. Industry Applications
// 38(3), 2002; Bachir, Tnani, Trigeassou, Champenois, Diagnosis by parameter estimation of stator and rotor
// faults occurring in induction machines, IEEE Trans. Industrial Electronics 53(3), 2006.

#include <array>
#include <cmath>

#include "plant/effects/effect.h"
#include "rig/base/space_vector.h"

namespace imrig::plant {

class ShortedTurns final : public Effect {
 public:
  struct Config {
    std::array<double, 3> share{};  // mu of each phase, all but one zero
    double fault_ohm = 0.0;         // R_f
  };

  explicit ShortedTurns(const Config& config) : config_(config) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (config.share[k] == 0.0) continue;
      mu_ = config.share[k];
      axis_ = std::polar(1.0, 2.0 * kPi / 3.0 * static_cast<double>(k));
    }
    coil_ = mu_ * (1.0 - 2.0 / 3.0 * mu_);
  }

  std::string name() const override { return "shorted_turns"; }
  unsigned hooks() const override { return mu_ > 0.0 ? kStates | kShunt | kLosses | kEnergy : 0u; }
  std::vector<Parameter> parameters() const override {
    return {{"share_a", "1", config_.share[0]},
            {"share_b", "1", config_.share[1]},
            {"share_c", "1", config_.share[2]},
            {"fault_ohm", "ohm", config_.fault_ohm}};
  }
  double settling_rate_per_s(double R_s, double L_ls) const override {
    return mu_ > 0.0 ? (config_.fault_ohm + coil_ * R_s) / (coil_ * L_ls) : 0.0;
  }
  std::size_t states() const override { return mu_ > 0.0 ? 1 : 0; }  // i_f
  void initial(double* own) const override {
    if (states()) own[0] = 0.0;
  }
  void shunt(const Conditions& at, const double* own, Shunt& branch) const override {
    const double seen = 2.0 / 3.0 * mu_, inverse_H = 1.0 / (coil_ * at.L_ls);
    const double x = axis_.real(), y = axis_.imag(), answer = seen * mu_ * inverse_H;
    branch.i += seen * own[0] * axis_;
    branch.xx += answer * x * x, branch.xy += answer * x * y, branch.yy += answer * y * y;
    branch.rate -= seen * resistance(at) * inverse_H * own[0] * axis_;
  }
  void derivatives(const Conditions& at, const double* own, double* d_own) const override {
    const double v = axis_.real() * at.v_s.real() + axis_.imag() * at.v_s.imag();
    d_own[0] = (mu_ * v - resistance(at) * own[0]) / (coil_ * at.L_ls);
  }
  void losses(const Conditions& at, const double* own, Losses& heat) const override {
    heat.stator_copper_W += resistance(at) * own[0] * own[0];
  }
  void energy(const Conditions& at, const double* own, double& stored_J) const override {
    stored_J += 0.5 * coil_ * at.L_ls * own[0] * own[0];
  }

 private:
  double resistance(const Conditions& at) const { return config_.fault_ohm + coil_ * at.R.R_s; }

  Config config_;
  double mu_ = 0.0, coil_ = 0.0;  // mu, mu (1 - 2 mu/3)
  std::complex<double> axis_ = 1.0;
};

}  // namespace imrig::plant
