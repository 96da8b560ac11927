#pragma once
// The phases do not get the same voltage: u_k = (1 + g_k) v_k for legs or lines of different gain. As space
// vectors
//   u = (1 + g_0) v + g_2 conj(v),   g_0 = (g_a + g_b + g_c)/3,   g_2 = (g_a + a^2 g_b + a g_c)/3,
// a = exp(j 2 pi/3): a balanced command gets the negative sequence |g_2| and the motor a current |g_2|
// V/Z_neg at slip 2 - s, double-frequency power and torque. Source: Fortescue 1918; IEC 60034-26.

#include "plant/effects/effect.h"
#include "rig/base/space_vector.h"

namespace imrig::plant {

class SupplyUnbalance final : public Effect {
 public:
  struct Config {
    double gain_a = 0.0, gain_b = 0.0, gain_c = 0.0;  // relative deviations
  };

  explicit SupplyUnbalance(const Config& config) : config_(config) {}
  std::string name() const override { return "supply_unbalance"; }
  unsigned hooks() const override {
    return config_.gain_a != 0.0 || config_.gain_b != 0.0 || config_.gain_c != 0.0 ? kAppliedVoltage : 0u;
  }
  std::vector<Parameter> parameters() const override {
    return {
        {"gain_a", "1", config_.gain_a}, {"gain_b", "1", config_.gain_b}, {"gain_c", "1", config_.gain_c}};
  }
  void applied_voltage(const Conditions& /*at*/, const double* /*own*/,
                       std::complex<double>& v) const override {
    const auto u = phases(v);
    v += space_vector(config_.gain_a * u[0], config_.gain_b * u[1], config_.gain_c * u[2]);
  }

 private:
  Config config_;
};

}  // namespace imrig::plant
