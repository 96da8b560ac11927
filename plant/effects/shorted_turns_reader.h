#pragma once
// [effects.shorted_turns]

#include <memory>

#include "plant/effects/shorted_turns.h"
#include "rig/base/config_reader.h"

namespace imrig::plant {

inline std::shared_ptr<const Effect> read_shorted_turns(const ConfigReader& table) {
  ShortedTurns::Config c;
  c.share[0] = table.number_or("share_a", 0.0, {0.0, 0.9});
  c.share[1] = table.number_or("share_b", 0.0, {0.0, 0.9});
  c.share[2] = table.number_or("share_c", 0.0, {0.0, 0.9});
  c.fault_ohm = table.number_or("fault_ohm", c.fault_ohm, {0.0, 1e3});
  const auto faulty = [&](std::size_t k) { return c.share[k] > 0.0 ? 1 : 0; };
  if (faulty(0) + faulty(1) + faulty(2) > 1)
    table.fail("share_c", "and another phase both have shorted turns", "one phase at a time");
  return std::make_shared<ShortedTurns>(c);
}

}  // namespace imrig::plant
