#pragma once
// Thermal network: stator winding s, rotor cage r, iron and frame f, ambient a. Each node warms with its
// losses:
//   C_s dT_s/dt = P_stator copper                        - G_sf (T_s - T_f)
//   C_r dT_r/dt = P_rotor copper                         - G_rf (T_r - T_f)
//   C_f dT_f/dt = P_iron + P_stray + P_friction + both   - G_fa (1 + k |w|/w_fan) (T_f - T_a)
// and resistances follow: R_s (k_s + T_s)/(k_s + T_ref), R_r (k_r + T_r)/(k_r + T_ref), k = 235 for copper,
// 225 for aluminium, T_ref the temperature for which the file gives them. `speedup` multiplies all rates (the
// losses' energy then counts speedup-fold): a long soak in little time; 0 holds the temperatures. Lumped
// nodes: no hot spot, end winding as warm as the slot, radiation within G_fa. The thermocouple reads T_s.
// Source: Mellor, Roberts, Turner, Lumped parameter thermal model for electrical machines of TEFC design, IEE
// Proc. B 138(5), 1991, reduced to three nodes; k: IEC 60034-1.

#include <algorithm>
#include <cmath>

#include "plant/effects/effect.h"
#include "rig/base/space_vector.h"

namespace imrig::plant {

class Thermal final : public Effect {
 public:
  struct Config {
    // J/K; all zero: no network
    double stator_J_per_K = 0.0, rotor_J_per_K = 0.0, iron_J_per_K = 0.0;
    // W/K
    double stator_iron_W_per_K = 0.0, rotor_iron_W_per_K = 0.0, iron_ambient_W_per_K = 0.0;
    double fan = 0.0;         // k
    double fan_rpm = 1800.0;  // w_fan
    double ambient_C = 25.0;
    double stator_C = 25.0, rotor_C = 25.0, iron_C = 25.0;  // at the start
    double reference_C = 25.0;                              // of R_s and R_r in the file
    double stator_k_C = 235.0, rotor_k_C = 225.0;           // copper; aluminium
    double speedup = 1.0;
  };

  explicit Thermal(const Config& config)
      : config_(config),
        stator_per_K_(1.0 / (config.stator_k_C + config.reference_C)),
        rotor_per_K_(1.0 / (config.rotor_k_C + config.reference_C)) {}
  std::string name() const override { return "thermal"; }
  unsigned hooks() const override {
    return config_.stator_J_per_K > 0.0 ? kStates | kTemperatures | kResistances | kMeasured | kReadsLosses
                                        : 0u;
  }
  std::vector<Parameter> parameters() const override {
    const Config& c = config_;
    return {{"stator_J_per_K", "J/K", c.stator_J_per_K},
            {"rotor_J_per_K", "J/K", c.rotor_J_per_K},
            {"iron_J_per_K", "J/K", c.iron_J_per_K},
            {"stator_iron_W_per_K", "W/K", c.stator_iron_W_per_K},
            {"rotor_iron_W_per_K", "W/K", c.rotor_iron_W_per_K},
            {"iron_ambient_W_per_K", "W/K", c.iron_ambient_W_per_K},
            {"fan", "1", c.fan},
            {"fan_rpm", "rpm", c.fan_rpm},
            {"ambient_C", "C", c.ambient_C},
            {"stator_C", "C", c.stator_C},
            {"rotor_C", "C", c.rotor_C},
            {"iron_C", "C", c.iron_C},
            {"reference_C", "C", c.reference_C},
            {"stator_k_C", "C", c.stator_k_C},
            {"rotor_k_C", "C", c.rotor_k_C},
            {"speedup", "1", c.speedup}};
  }

  // At twice the fan's speed.
  double fastest_rate_per_s() const override {
    const Config& c = config_;
    if (!hooks()) return 0.0;
    const double to_ambient = c.iron_ambient_W_per_K * (1.0 + 2.0 * c.fan);
    return c.speedup *
           std::max({c.stator_iron_W_per_K / c.stator_J_per_K, c.rotor_iron_W_per_K / c.rotor_J_per_K,
                     (c.stator_iron_W_per_K + c.rotor_iron_W_per_K + to_ambient) / c.iron_J_per_K});
  }

  bool slow() const override { return fastest_rate_per_s() < 1.0; }
  std::size_t states() const override { return hooks() ? 3 : 0; }
  void initial(double* own) const override {
    if (!states()) return;
    own[kStator] = config_.stator_C, own[kRotor] = config_.rotor_C, own[kIron] = config_.iron_C;
  }
  void temperatures(const Conditions&, const double* own, Temperatures& at) const override {
    at = {own[kStator], own[kRotor], own[kIron], config_.ambient_C};
  }
  void resistances(const Conditions& at, const double* /*own*/, Resistances& R) const override {
    const Config& c = config_;
    R.R_s *= 1.0 + (at.temperature.stator_C - c.reference_C) * stator_per_K_;
    R.R_r *= 1.0 + (at.temperature.rotor_C - c.reference_C) * rotor_per_K_;
  }
  void derivatives(const Conditions& at, const double* own, double* d_own) const override {
    const Config& c = config_;
    const Losses& heat = at.losses;
    const double from_stator_W = c.stator_iron_W_per_K * (own[kStator] - own[kIron]);
    const double from_rotor_W = c.rotor_iron_W_per_K * (own[kRotor] - own[kIron]);
    const double iron_W = heat.iron_W + heat.stray_W + heat.friction_W + from_stator_W + from_rotor_W;
    d_own[kStator] = c.speedup * (heat.stator_copper_W - from_stator_W) / c.stator_J_per_K;
    d_own[kRotor] = c.speedup * (heat.rotor_copper_W - from_rotor_W) / c.rotor_J_per_K;
    d_own[kIron] = c.speedup * (iron_W - to_ambient_W(at.w_mech, own[kIron])) / c.iron_J_per_K;
  }
  void measured(const Conditions& at, const double* /*own*/, Measured& values) const override {
    values.stator_C = at.temperature.stator_C;
  }
  double to_ambient_W(double w_mech, double iron_C) const {
    const double air = std::abs(w_mech) / (rad_s_of_rpm(config_.fan_rpm));
    return config_.iron_ambient_W_per_K * (1.0 + config_.fan * air) * (iron_C - config_.ambient_C);
  }

 private:
  enum Node { kStator, kRotor, kIron };
  Config config_;
  double stator_per_K_, rotor_per_K_;  // temperature coefficients at T_ref
};

}  // namespace imrig::plant
