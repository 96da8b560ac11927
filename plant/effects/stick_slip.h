#pragma once
// A bearing that sticks. In motion its torque falls from break-away T_s to Coulomb T_c,
//   T = [T_c + (T_s - T_c) exp(-(w/w_s)^2)] sgn w     (Stribeck);
// at rest it holds whatever pulls at the shaft, up to T_s: the speed is zero, not small, and the angle stays
// (plant/sticking_integrator.h). The falling branch around w_s feeds the stick-slip of an elastic shaft. No
// dwell time, no presliding: a stuck bearing is rigid. Source: Armstrong-Helouvry, Dupont, Canudas de Wit, A
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
  };

  explicit StickSlip(const Config& config) : config_(config) {}
  std::string name() const override { return "stick_slip"; }
  unsigned hooks() const override {
    return config_.break_away_Nm > 0.0 || config_.coulomb_Nm > 0.0 ? kDrag : 0u;
  }
  std::vector<Parameter> parameters() const override {
    return {{"break_away_Nm", "Nm", config_.break_away_Nm},
            {"coulomb_Nm", "Nm", config_.coulomb_Nm},
            {"stribeck_rad_s", "rad/s", config_.stribeck_rad_s}};
  }
  double break_away_Nm() const override { return config_.break_away_Nm; }
  double drag_Nm(const Conditions& at, const double* /*own*/) const override {
    const double s = at.w_mech / config_.stribeck_rad_s;
    const double level = config_.coulomb_Nm + (config_.break_away_Nm - config_.coulomb_Nm) * std::exp(-s * s);
    return level * sense(at);
  }

 private:
  Config config_;
};

}  // namespace imrig::plant
