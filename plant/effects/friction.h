#pragma once
// Bearing friction: T = T_c w/sqrt(w^2 + w_0^2) + b w, against the motion. The Coulomb part is smooth within
// about w_0 of rest: under a torque T < T_c the shaft creeps at w = w_0 T/sqrt(T_c^2 - T^2). With w_0 of a few
// mrad/s that is less than an encoder count a second, and the shaft sticks; it breaks away above T_c. The rate
// T_c/(J w_0) must stay well below the inverse of the sample time. Source: Armstrong-Helouvry, Control of Machines with Friction, 1991.

#include <cmath>

#include "plant/effects/effect.h"

namespace imrig::plant {

class Friction final : public Effect {
 public:
  struct Config {
    double coulomb_Nm = 0.0;
    double viscous_Nms = 0.0;
    double width_rad_s = 0.2;  // w_0
  };

  explicit Friction(const Config& config) : config_(config) {}
  std::string name() const override { return "friction"; }
  unsigned hooks() const override { return kDrag; }
  std::vector<Parameter> parameters() const override {
    return {{"coulomb_Nm", "Nm", config_.coulomb_Nm},
            {"viscous_Nms", "Nm s/rad", config_.viscous_Nms},
            {"width_rad_s", "rad/s", config_.width_rad_s}};
  }
  void drag(const Conditions& at, const double* /*own*/, double& torque_Nm) const override {
    const double w = at.w_mech;
    torque_Nm += config_.coulomb_Nm * w / std::sqrt(w * w + config_.width_rad_s * config_.width_rad_s) +
                 config_.viscous_Nms * w;
  }

 private:
  Config config_;
};

}  // namespace imrig::plant
