#pragma once
// [effects.inverter_dead_time]

#include <memory>

#include "plant/effects/inverter_dead_time.h"
#include "rig/base/config_reader.h"

namespace imrig::plant {

inline std::shared_ptr<const Effect> read_inverter_dead_time(const ConfigReader& table) {
  InverterDeadTime::Config c;
  c.dead_time_s = table.number_or("dead_time_s", c.dead_time_s, {0.0, 1e-4});
  c.drop_V = table.number_or("drop_V", c.drop_V, {0.0, 10.0});
  c.drop_ohm = table.number_or("drop_ohm", c.drop_ohm, {0.0, 10.0});
  c.width_A = table.number_or("width_A", c.width_A, {0.01, 100.0});
  return std::make_shared<InverterDeadTime>(c);
}

}  // namespace imrig::plant
