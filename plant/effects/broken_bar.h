#pragma once
// n broken bars out of N lying side by side. A phase of the equivalent three-phase cage is N/3 bars beside
// each other; without n of them its resistance grows by (N/3)/(N/3 - n) - 1 = 3 n/(N - 3 n) of itself, which
// turns with the rotor (theta_e = n_p theta):
//   R <- R (1 + k),   R_conj <- R_conj + k R exp(j 2 theta_e),   k = n/(N - 3 n).
// A stator current at f then answers with lines at (1 - 2 s) f and, through the torque's ripple at 2 s f and
// the speed's, at (1 + 2 s) f. Assumes one group of neighbours at angle 0 and no current from bar to bar.
// Source: Bellini, Filippetti, Tassoni, Capolino, Advances in Diagnostic Techniques for Induction Machines,
// IEEE Trans. Industrial Electronics 55(12), 2008 (the lines and what makes them; the growth is derived
// above).

#include <cmath>

#include "plant/effects/effect.h"

namespace imrig::plant {

class BrokenBar final : public Effect {
 public:
  struct Config {
    double broken = 0.0;  // n; a fraction is a cracked bar
    double bars = 28.0;   // N
  };

  explicit BrokenBar(const Config& config)
      : config_(config), k_(config.broken / (config.bars - 3.0 * config.broken)) {}

  double asymmetry() const { return k_; }
  std::string name() const override { return "broken_bar"; }
  unsigned hooks() const override { return config_.broken > 0.0 ? kRotorDrop : 0u; }
  std::vector<Parameter> parameters() const override {
    return {{"broken", "bars", config_.broken}, {"bars", "bars", config_.bars}};
  }
  void rotor_drop(const Conditions& at, const double* /*own*/, RotorDrop& drop) const override {
    drop.R_conj += std::polar(k_ * drop.R, 2.0 * at.n_p * at.angle);
    drop.R *= 1.0 + k_;
  }

 private:
  Config config_;
  double k_;
};

}  // namespace imrig::plant
