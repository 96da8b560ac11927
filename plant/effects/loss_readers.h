#pragma once
// [effects.iron_loss], [effects.stray_load_loss], [effects.windage]

#include <memory>

#include "plant/effects/iron_loss.h"
#include "plant/effects/stray_load_loss.h"
#include "plant/effects/windage.h"
#include "rig/base/config_reader.h"

namespace imrig::plant {

inline std::shared_ptr<const Effect> read_iron_loss(const ConfigReader& table) {
  IronLoss::Config c;
  c.hysteresis_W = table.number_or("hysteresis_W", c.hysteresis_W, {0.0, 1e6});
  c.eddy_W = table.number_or("eddy_W", c.eddy_W, {0.0, 1e6});
  c.rated_psi_Wb = table.number_or("rated_psi_Wb", c.rated_psi_Wb, {1e-3, 1e3});
  c.rated_f_Hz = table.number_or("rated_f_Hz", c.rated_f_Hz, {1.0, 1e3});
  c.exponent = table.number_or("exponent", c.exponent, {1.0, 3.0});
  c.memory_s = table.number_or("memory_s", c.memory_s, {2e-4, 1.0});
  return std::make_shared<IronLoss>(c);
}

inline std::shared_ptr<const Effect> read_stray_load_loss(const ConfigReader& table) {
  StrayLoadLoss::Config c;
  c.loss_W = table.number_or("loss_W", c.loss_W, {0.0, 1e6});
  c.basis = table.choice_or("basis", {"current", "torque"}, "current") == "torque"
                ? StrayLoadLoss::Basis::kTorque
                : StrayLoadLoss::Basis::kCurrent;
  c.rated_A = table.number_or("rated_A", c.rated_A, {1e-3, 1e5});
  c.rated_Nm = table.number_or("rated_Nm", c.rated_Nm, {1e-3, 1e6});
  c.rated_rpm = table.number_or("rated_rpm", c.rated_rpm, {1.0, 1e5});
  c.exponent = table.number_or("exponent", c.exponent, {1.0, 4.0});
  return std::make_shared<StrayLoadLoss>(c);
}

inline std::shared_ptr<const Effect> read_windage(const ConfigReader& table) {
  Windage::Config c;
  c.quadratic_Nms2 = table.number_or("quadratic_Nms2", c.quadratic_Nms2, {0.0, 10.0});
  c.cubic_Nms3 = table.number_or("cubic_Nms3", c.cubic_Nms3, {0.0, 1.0});
  return std::make_shared<Windage>(c);
}

}  // namespace imrig::plant
