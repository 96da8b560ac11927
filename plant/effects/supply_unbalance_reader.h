#pragma once
// [effects.supply_unbalance]

#include <memory>

#include "plant/effects/supply_unbalance.h"
#include "rig/base/config_reader.h"

namespace imrig::plant {

inline std::shared_ptr<const Effect> read_supply_unbalance(const ConfigReader& table) {
  SupplyUnbalance::Config c;
  c.gain_a = table.number_or("gain_a", c.gain_a, {-0.5, 0.5});
  c.gain_b = table.number_or("gain_b", c.gain_b, {-0.5, 0.5});
  c.gain_c = table.number_or("gain_c", c.gain_c, {-0.5, 0.5});
  return std::make_shared<SupplyUnbalance>(c);
}

}  // namespace imrig::plant
