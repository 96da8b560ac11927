#include "plant/effects/registry.h"

#include "plant/effects/friction.h"
#include "plant/effects/saturation_reader.h"
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
      {"magnetizing_saturation", "the main flux saturates the iron around the air gap",
       read_magnetizing_saturation, "", "saturated_ratio = 0.1\nknee_Wb = 0.35\nsoftness = 0.3"},
      {"leakage_saturation", "the leakage paths of stator and rotor saturate with their own currents",
       read_leakage_saturation, "",
       "stator_saturated_ratio = 0.3\nstator_knee_A = 15\nrotor_saturated_ratio = 0.3\nrotor_knee_A = 15"},
      {"cross_saturation", "teeth carry main and leakage flux together, so that torque current magnetizes less",
       read_cross_saturation, "", "saturated_ratio = 0.1\nknee_Wb = 0.35\nleakage_share = 1.0"},
      {"friction", "bearings brake the shaft with a constant and a speed-proportional torque", read_friction},
  };
  return registry;
}

}  // namespace imrig::plant
