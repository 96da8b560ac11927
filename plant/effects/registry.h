#pragma once
// Every effect the plant knows, one line each in registry.cc, in the order in which they are applied.

#include <memory>
#include <string>
#include <vector>

#include "plant/effects/effect.h"

namespace imrig {
class ConfigReader;
}

namespace imrig::plant {

struct EffectEntry {
  std::string name;
  std::string physics;                                               // one sentence
  std::shared_ptr<const Effect> (*read)(const ConfigReader& table);  // its table [effects.NAME]
  // For the test that walks the registry (tests/plant/registry_test.cc): the table's lines at which the
  // effect changes no bit, and at which it is strong. Neutral is normally the empty table.
  std::string neutral = "";
  std::string strong = "";
};

const std::vector<EffectEntry>& effect_registry();

}  // namespace imrig::plant
