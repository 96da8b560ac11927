#pragma once
// Bearing friction: T = T_c sgn w + b w, against the motion. At rest it holds whatever pulls at the shaft up
// to T_c: speed and angle then keep every bit (plant/sticking_integrator.h); stick_slip.h has a break-away
// torque above that of the motion. With a width w_0 the jump is smooth, T = T_c w/sqrt(w^2 + w_0^2) + b w,
// and nothing sticks: under a torque T < T_c the shaft creeps at w = w_0 T/sqrt(T_c^2 - T^2). The rate T_c/(J
// w_0) must then stay well below the inverse of the sample time. Source: Armstrong-Helouvry, Control of
// Machines with Friction, 1991.

#include <cmath>

#include "plant/effects/effect.h"

namespace imrig::plant {

class Friction final : public Effect {
 public:
  struct Config {
    double coulomb_Nm = 0.0;
    double viscous_Nms = 0.0;
    double width_rad_s = 0.0;  // w_0; 0: a jump, and it sticks
  };

  explicit Friction(const Config& config) : config_(config) {}
  std::string name() const override { return "friction"; }
  unsigned hooks() const override { return kDrag; }
  std::vector<Parameter> parameters() const override {
    return {{"coulomb_Nm", "Nm", config_.coulomb_Nm},
            {"viscous_Nms", "Nm s/rad", config_.viscous_Nms},
            {"width_rad_s", "rad/s", config_.width_rad_s}};
  }
  double break_away_Nm() const override { return config_.width_rad_s > 0.0 ? 0.0 : config_.coulomb_Nm; }
  double drag_Nm(const Conditions& at, const double* /*own*/) const override {
    const double w = at.w_mech, w_0 = config_.width_rad_s;
    const double share = w_0 > 0.0 ? w / std::sqrt(w * w + w_0 * w_0) : sense(at);
    return config_.coulomb_Nm * share + config_.viscous_Nms * w;
  }

 private:
  Config config_;
};

}  // namespace imrig::plant
