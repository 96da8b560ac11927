#include "plant/effects/registry.h"

#include "plant/effects/friction.h"
#include "rig/base/config_reader.h"

namespace imrig::plant {
namespace {

std::shared_ptr<const Effect> read_friction(const ConfigReader& table) {
  Friction::Config config;
  config.coulomb_Nm = table.number_or("coulomb_Nm", config.coulomb_Nm, {0.0, 1e3});
  config.viscous_Nms = table.number_or("viscous_Nms", config.viscous_Nms, {0.0, 1e2});
  config.width_rad_s = table.number_or("width_rad_s", config.width_rad_s, {1e-4, 100.0});
  return std::make_shared<Friction>(config);
}

}  // namespace

const std::vector<EffectEntry>& effect_registry() {
  static const std::vector<EffectEntry> registry = {
      {"friction", "bearings brake the shaft with a constant and a speed-proportional torque", read_friction},
  };
  return registry;
}

}  // namespace imrig::plant
