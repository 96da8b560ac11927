#include "plant/effects/registry.h"

#include "plant/effects/broken_bar_reader.h"
#include "plant/effects/faults_reader.h"
#include "plant/effects/friction.h"
#include "plant/effects/inverter_dead_time_reader.h"
#include "plant/effects/loss_readers.h"
#include "plant/effects/rotor_skin_effect_reader.h"
#include "plant/effects/saturation_reader.h"
#include "plant/effects/sensors_reader.h"
#include "plant/effects/shorted_turns_reader.h"
#include "plant/effects/stator_unbalance_reader.h"
#include "plant/effects/supply_unbalance_reader.h"
#include "plant/effects/thermal_reader.h"
#include "rig/base/config_reader.h"

namespace imrig::plant {
namespace {

std::shared_ptr<const Effect> read_friction(const ConfigReader& table) {
  Friction::Config config;
  config.coulomb_Nm = table.number_or("coulomb_Nm", config.coulomb_Nm, {0.0, 1e3});
  config.viscous_Nms = table.number_or("viscous_Nms", config.viscous_Nms, {0.0, 1e2});
  config.width_rad_s = table.number_or("width_rad_s", config.width_rad_s, {0.0, 100.0});
  if (config.width_rad_s > 0.0 && config.width_rad_s < 1e-4)
    table.fail("width_rad_s", "is too steep to follow", "0 (sticks), or 0.0001 to 100 rad/s");
  return std::make_shared<Friction>(config);
}

}  // namespace

const std::vector<EffectEntry>& effect_registry() {
  static const std::vector<EffectEntry> registry = {
      {"thermal", "winding, cage and iron warm with their losses, and resistances with them", read_thermal, "",
       "stator_J_per_K = 40\nrotor_J_per_K = 20\niron_J_per_K = 80\nstator_iron_W_per_K = 10\nrotor_iron_W_per_K = "
       "10\niron_ambient_W_per_K = 5"},
      {"magnetizing_saturation", "the main flux saturates the iron around the air gap",
       read_magnetizing_saturation, "", "saturated_ratio = 0.1\nknee_Wb = 0.35\nsoftness = 0.3"},
      {"leakage_saturation", "the leakage paths of stator and rotor saturate with their own currents",
       read_leakage_saturation, "",
       "stator_saturated_ratio = 0.3\nstator_knee_A = 15\nrotor_saturated_ratio = 0.3\nrotor_knee_A = 15"},
      {"cross_saturation", "teeth carry main and leakage flux together, so that torque current magnetizes less",
       read_cross_saturation, "", "saturated_ratio = 0.1\nknee_Wb = 0.35\nleakage_share = 1.0"},
      {"friction", "bearings brake the shaft with a constant and a speed-proportional torque", read_friction,
       "", "coulomb_Nm = 2.0\nviscous_Nms = 0.02"},
      {"windage", "the fan and the rotor's surface stir air", read_windage, "",
       "quadratic_Nms2 = 5e-5\ncubic_Nms3 = 2e-7"},
      {"stray_load_loss", "slot and tooth pulsation burn power under load and brake the shaft for it",
       read_stray_load_loss, "", "loss_W = 300"},
      {"iron_loss", "the iron burns power when its flux changes: hysteresis and eddy currents", read_iron_loss, "",
       "hysteresis_W = 200\neddy_W = 200"},
      {"supply_unbalance", "the phases of the supply differ in voltage", read_supply_unbalance, "",
       "gain_a = 0.05\ngain_b = -0.05"},
      {"inverter_dead_time", "dead time, switches and diodes take a part of each phase's voltage against its current",
       read_inverter_dead_time, "", "dead_time_s = 4e-6\ndrop_V = 1.5\ndrop_ohm = 0.05"},
      {"stator_unbalance", "the phases of the stator's winding differ in resistance", read_stator_unbalance, "",
       "extra_a = 0.5"},
      {"shorted_turns", "turns of one stator phase are shorted, and a current circulates in them", read_shorted_turns,
       "", "share_a = 0.1\nfault_ohm = 0.02"},
      {"broken_bar", "broken bars make the cage's resistance asymmetric, and turn with it", read_broken_bar, "",
       "bars = 28\nbroken = 2"},
      {"rotor_skin_effect", "the rotor's current crowds to the top of deep bars as the slip frequency rises",
       read_rotor_skin_effect, "", "bar_height_m = 0.03\nbar_fraction = 0.8"},
      {"current_sensors", "current sensors lag, err in gain and offset, talk across and bend", read_current_sensors, "",
       "gain_a = 0.02\noffset_b = 0.3\ncrosstalk = 0.01\ncubic = -0.02\nlag_s = 100e-6\ndelay_s = 60e-6"},
      {"voltage_sensors", "voltage dividers err in gain and offset and talk across", read_voltage_sensors, "",
       "gain_a = 0.02\noffset_b = 3.0\ncrosstalk = 0.01"},
      {"encoder_eccentricity", "the encoder reads wrong once and twice per turn", read_encoder_eccentricity, "",
       "once_rad = 0.01\ntwice_rad = 0.005"},
      {"thermocouple", "the winding's thermocouple lags and errs", read_thermocouple, "",
       "lag_s = 30\ngain = 0.02\noffset_C = 1.5"},
      {"eccentricity", "the rotor is not in its centre: the gap varies with stator and shaft", read_eccentricity, "",
       "static_share = 0.4\ndynamic_share = 0.3"},
      {"interbar_current", "currents between the bars shunt the skew leakage and burn power", read_interbar_current, "",
       "inductance_H = 0.0015\nresistance_ohm = 0.6"},
      {"stick_slip", "the bearing sticks, and brakes less once it moves", read_stick_slip, "",
       "break_away_Nm = 1.0\ncoulomb_Nm = 0.4"},
      {"coupling_torsion", "motor and generator are two masses on a shaft that twists", read_coupling_torsion, "",
       "stiffness_Nm = 800\ndamping_Nms = 0.1"},
  };
  return registry;
}

}  // namespace imrig::plant
