#pragma once
// The winding's temperature sensor sits in its own housing: tau dT_m/dt = T - T_m, and is calibrated with a
// gain and an offset: reading = (1 + g) T_m + o. T: the winding's temperature (constant unless a thermal
// effect moves it), to which the sensor is equal at the start.

#include "plant/effects/effect.h"

namespace imrig::plant {

class Thermocouple final : public Effect {
 public:
  struct Config {
    double lag_s = 0.0, gain = 0.0, offset_C = 0.0;
  };

  explicit Thermocouple(const Config& config) : config_(config) {}
  std::string name() const override { return "thermocouple"; }
  unsigned hooks() const override {
    const bool acts = config_.lag_s > 0.0 || config_.gain != 0.0 || config_.offset_C != 0.0;
    return (acts ? kMeasured : 0u) | (config_.lag_s > 0.0 ? kStates : 0u);
  }
  std::vector<Parameter> parameters() const override {
    return {{"lag_s", "s", config_.lag_s}, {"gain", "1", config_.gain}, {"offset_C", "K", config_.offset_C}};
  }
  std::size_t states() const override { return config_.lag_s > 0.0 ? 1 : 0; }
  void initial(double* own) const override { own[0] = Temperatures().stator_C; }
  void derivatives(const Conditions& at, const double* own, double* d_own) const override {
    d_own[0] = (at.temperature.stator_C - own[0]) / config_.lag_s;
  }
  void measured(const Conditions& at, const double* own, Measured& values) const override {
    if (config_.lag_s > 0.0) values.stator_C -= at.temperature.stator_C - own[0];
    values.stator_C = (1.0 + config_.gain) * values.stator_C + config_.offset_C;
  }

 private:
  Config config_;
};

}  // namespace imrig::plant
