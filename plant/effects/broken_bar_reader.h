#pragma once
// [effects.broken_bar]

#include <memory>

#include "plant/effects/broken_bar.h"
#include "rig/base/config_reader.h"

namespace imrig::plant {

inline std::shared_ptr<const Effect> read_broken_bar(const ConfigReader& table) {
  BrokenBar::Config c;
  c.bars = table.number_or("bars", c.bars, {6.0, 500.0});
  c.broken = table.number_or("broken", c.broken, {0.0, 100.0});
  if (c.broken > c.bars / 6.0)
    table.fail("broken", "is more than a sixth of the bars", "neighbours break one by one");
  return std::make_shared<BrokenBar>(c);
}

}  // namespace imrig::plant
