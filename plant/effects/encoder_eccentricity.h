#pragma once
// An encoder disc that is not mounted centrally reads wrong once per turn, an oval or tilted one twice:
//   theta_read = theta + e_1 sin(theta + phi_1) + e_2 sin(2 theta + phi_2).
// The speed from the counts ripples by e_k k w at k times the shaft's frequency; it is a twin of an
// eccentric rotor there. Missed counts are a setting of the sensors (encoder_loss). Source: Heidenhain,
// Angle Encoders Without Integral Bearing (eccentricity e at grating diameter D gives e_1 = 2 e/D).

#include <cmath>

#include "plant/effects/effect.h"

namespace imrig::plant {

class EncoderEccentricity final : public Effect {
 public:
  struct Config {
    double once_rad = 0.0, once_phase_rad = 0.0, twice_rad = 0.0, twice_phase_rad = 0.0;
  };

  explicit EncoderEccentricity(const Config& config) : config_(config) {}
  std::string name() const override { return "encoder_eccentricity"; }
  unsigned hooks() const override {
    return config_.once_rad != 0.0 || config_.twice_rad != 0.0 ? kMeasured : 0u;
  }
  std::vector<Parameter> parameters() const override {
    return {{"once_rad", "rad", config_.once_rad},
            {"once_phase_rad", "rad", config_.once_phase_rad},
            {"twice_rad", "rad", config_.twice_rad},
            {"twice_phase_rad", "rad", config_.twice_phase_rad}};
  }
  void measured(const Conditions& at, const double* /*own*/, Measured& values) const override {
    values.encoder_rad += config_.once_rad * std::sin(at.angle + config_.once_phase_rad) +
                          config_.twice_rad * std::sin(2.0 * at.angle + config_.twice_phase_rad);
  }

 private:
  Config config_;
};

}  // namespace imrig::plant
