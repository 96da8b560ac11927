#pragma once
// Windage: the fan and the rotor's surface stir air, T = c_2 w |w| + c_3 w^2 w, against the motion. The power
// goes with the third power of speed (fan, turbulent) and the fourth. Beside friction.h, which has the
// bearings. Source: Vrancik, Prediction of Windage Power Loss in Alternators, NASA TN D-4849, 1968 (turbulent
// gap); Pyrhonen, Jokinen, Hrabovcova, Design of Rotating Electrical Machines, 2nd ed., section 9.1.

#include <cmath>

#include "plant/effects/effect.h"

namespace imrig::plant {

class Windage final : public Effect {
 public:
  struct Config {
    double quadratic_Nms2 = 0.0;  // c_2
    double cubic_Nms3 = 0.0;      // c_3
  };

  explicit Windage(const Config& config) : config_(config) {}
  std::string name() const override { return "windage"; }
  unsigned hooks() const override {
    return config_.quadratic_Nms2 > 0.0 || config_.cubic_Nms3 > 0.0 ? kDrag : 0u;
  }
  std::vector<Parameter> parameters() const override {
    return {{"quadratic_Nms2", "Nm s^2/rad^2", config_.quadratic_Nms2},
            {"cubic_Nms3", "Nm s^3/rad^3", config_.cubic_Nms3}};
  }
  double drag_Nm(const Conditions& at, const double* /*own*/) const override {
    const double w = at.w_mech;
    return (config_.quadratic_Nms2 * std::abs(w) + config_.cubic_Nms3 * w * w) * w;
  }

 private:
  Config config_;
};

}  // namespace imrig::plant
