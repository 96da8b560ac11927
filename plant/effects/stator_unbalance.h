#pragma once
// A stator winding whose phases differ in resistance (a bad joint, a repaired coil): R_k = (1 + r_k) R_s. As
// space vectors the drop is R_s i + R_s_conj conj(i):
//   R_s <- R_s (1 + (r_a + r_b + r_c)/3),   R_s_conj <- R_s_conj + R_s (r_a + a^2 r_b + a r_c)/3,
// a = exp(j 2 pi/3). A balanced voltage draws a negative-sequence current. Magnetically the phases stay
// alike; shorted turns are in shorted_turns.h. Source: Fortescue's
// components of a diagonal impedance matrix, 1918.

#include "plant/effects/effect.h"
#include "rig/base/space_vector.h"

namespace imrig::plant {

class StatorUnbalance final : public Effect {
 public:
  struct Config {
    double extra_a = 0.0, extra_b = 0.0, extra_c = 0.0;  // r_k
  };

  explicit StatorUnbalance(const Config& config)
      : config_(config),
        mean_((config.extra_a + config.extra_b + config.extra_c) / 3.0),
        // Half the conjugate of the space vector of r.
        conj_(0.5 * std::conj(space_vector(config.extra_a, config.extra_b, config.extra_c))) {}

  std::string name() const override { return "stator_unbalance"; }
  unsigned hooks() const override {
    return config_.extra_a != 0.0 || config_.extra_b != 0.0 || config_.extra_c != 0.0 ? kResistances : 0u;
  }
  std::vector<Parameter> parameters() const override {
    return {{"extra_a", "1", config_.extra_a},
            {"extra_b", "1", config_.extra_b},
            {"extra_c", "1", config_.extra_c}};
  }
  void resistances(const Conditions& /*at*/, const double* /*own*/, Resistances& R) const override {
    R.R_s_conj += R.R_s * conj_;
    R.R_s *= 1.0 + mean_;
  }

 private:
  Config config_;
  double mean_;
  std::complex<double> conj_;
};

}  // namespace imrig::plant
