#pragma once
// A bearing that sticks: the break-away torque T_s falls to the Coulomb torque T_c as the shaft moves,
//   T = [T_c + (T_s - T_c) exp(-(w/w_s)^2)] w/sqrt(w^2 + w_0^2)     (Stribeck).
// The falling branch around w_s feeds the stick-slip of an elastic shaft. Within about w_0 of rest the sign
// is smooth: a stuck shaft creeps at w_0 T/T_s or so. Source: Armstrong-Helouvry, Dupont, Canudas de Wit, A
// survey of models, analysis tools and compensation methods for the control of machines with friction,
// Automatica 30(7), 1994.

#include <cmath>

#include "plant/effects/effect.h"

namespace imrig::plant {

class StickSlip final : public Effect {
 public:
  struct Config {
    double break_away_Nm = 0.0, coulomb_Nm = 0.0;
    double stribeck_rad_s = 2.0;  // w_s
    double width_rad_s = 0.02;    // w_0
  };

  explicit StickSlip(const Config& config) : config_(config) {}
  std::string name() const override { return "stick_slip"; }
  unsigned hooks() const override {
    return config_.break_away_Nm > 0.0 || config_.coulomb_Nm > 0.0 ? kDrag : 0u;
  }
  std::vector<Parameter> parameters() const override {
    return {{"break_away_Nm", "Nm", config_.break_away_Nm},
            {"coulomb_Nm", "Nm", config_.coulomb_Nm},
            {"stribeck_rad_s", "rad/s", config_.stribeck_rad_s},
            {"width_rad_s", "rad/s", config_.width_rad_s}};
  }
  void drag(const Conditions& at, const double* /*own*/, double& torque_Nm) const override {
    const double w = at.w_mech, s = w / config_.stribeck_rad_s;
    const double level = config_.coulomb_Nm + (config_.break_away_Nm - config_.coulomb_Nm) * std::exp(-s * s);
    torque_Nm += level * w / std::sqrt(w * w + config_.width_rad_s * config_.width_rad_s);
  }

 private:
  Config config_;
};

}  // namespace imrig::plant
