#pragma once
// [effects.rotor_skin_effect]

#include <memory>

#include "plant/effects/rotor_skin_effect.h"
#include "rig/base/config_reader.h"

namespace imrig::plant {

inline std::shared_ptr<const Effect> read_rotor_skin_effect(const ConfigReader& table) {
  RotorSkinEffect::Config c;
  c.bar_height_m = table.number_or("bar_height_m", c.bar_height_m, {0.0, 0.2});
  c.resistivity_ohm_m = table.number_or("resistivity_ohm_m", c.resistivity_ohm_m, {1e-8, 1e-6});
  c.bar_fraction = table.number_or("bar_fraction", c.bar_fraction, {0.0, 1.0});
  return std::make_shared<RotorSkinEffect>(c);
}

}  // namespace imrig::plant
