#include "estimators/model/model.h"

#include "rig/base/error.h"

namespace imrig::est {

const std::array<BaseParameter, 4>& base_parameters() {
  static const std::array<BaseParameter, 4> all{{{"R_s", "ohm", &Model::R_s},
                                                 {"R_r", "ohm", &Model::R_r},
                                                 {"L_l", "H", &Model::L_l},
                                                 {"L_m", "H", &Model::L_m}}};
  return all;
}

MachineParameters<double> Model::machine() const {
  for (const auto& entry : base_parameters()) {
    if (!(this->*entry.place).known())
      throw Error("model \"" + name + "\"", std::string("does not know ") + entry.name,
                  "imrig identify finds it, imrig improve MODEL DATA fits what a model lacks");
  }
  return {R_s.value, R_r.value, L_l.value, L_m.value};
}

Model nominal_model(const MotorConfig& motor) {
  Model model;
  model.name = motor.name;
  model.pole_pairs = motor.pole_pairs;
  model.ratings = {motor.rated_voltage_V, motor.rated_frequency_Hz, motor.rated_current_A,
                   motor.rated_speed_rpm, motor.rated_power_W};
  const std::array<double, 4> values{motor.R_s_ohm, motor.R_r_ohm, motor.L_l_H, motor.L_m_H};
  for (std::size_t k = 0; k < values.size(); ++k) {
    const auto& entry = base_parameters()[k];
    model.*entry.place = Parameter{values[k], kMissing, kMissing, entry.unit, "nominal"};
  }
  return model;
}

}  // namespace imrig::est
