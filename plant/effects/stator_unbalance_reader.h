#pragma once
// [effects.stator_unbalance]

#include <memory>

#include "plant/effects/stator_unbalance.h"
#include "rig/base/config_reader.h"

namespace imrig::plant {

inline std::shared_ptr<const Effect> read_stator_unbalance(const ConfigReader& table) {
  StatorUnbalance::Config c;
  c.extra_a = table.number_or("extra_a", c.extra_a, {-0.9, 10.0});
  c.extra_b = table.number_or("extra_b", c.extra_b, {-0.9, 10.0});
  c.extra_c = table.number_or("extra_c", c.extra_c, {-0.9, 10.0});
  return std::make_shared<StatorUnbalance>(c);
}

}  // namespace imrig::plant
