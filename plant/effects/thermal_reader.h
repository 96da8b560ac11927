#pragma once
// [effects.thermal]. Temperatures at the start are the ambient's unless given.

#include <algorithm>
#include <memory>

#include "plant/effects/thermal.h"
#include "rig/base/config_reader.h"

namespace imrig::plant {

inline std::shared_ptr<const Effect> read_thermal(const ConfigReader& table) {
  Thermal::Config c;
  const Range capacity{0.0, 1e9}, conductance{0.0, 1e6}, celsius{-60.0, 400.0};
  c.stator_J_per_K = table.number_or("stator_J_per_K", 0.0, capacity);
  c.rotor_J_per_K = table.number_or("rotor_J_per_K", 0.0, capacity);
  c.iron_J_per_K = table.number_or("iron_J_per_K", 0.0, capacity);
  const bool any = c.stator_J_per_K > 0.0 || c.rotor_J_per_K > 0.0 || c.iron_J_per_K > 0.0;
  if (any && !(c.stator_J_per_K > 0.0 && c.rotor_J_per_K > 0.0 && c.iron_J_per_K > 0.0))
    table.fail("stator_J_per_K", "is given without the other heat capacities, or is zero",
               "stator_J_per_K, rotor_J_per_K and iron_J_per_K positive, or none of them");
  c.stator_iron_W_per_K = table.number_or("stator_iron_W_per_K", 0.0, conductance);
  c.rotor_iron_W_per_K = table.number_or("rotor_iron_W_per_K", 0.0, conductance);
  c.iron_ambient_W_per_K = table.number_or("iron_ambient_W_per_K", 0.0, conductance);
  c.fan = table.number_or("fan", c.fan, {0.0, 100.0});
  c.fan_rpm = table.number_or("fan_rpm", c.fan_rpm, {1.0, 1e5});
  c.ambient_C = table.number_or("ambient_C", c.ambient_C, celsius);
  c.stator_C = table.number_or("stator_C", c.ambient_C, celsius);
  c.rotor_C = table.number_or("rotor_C", c.ambient_C, celsius);
  c.iron_C = table.number_or("iron_C", c.ambient_C, celsius);
  c.reference_C = table.number_or("reference_C", c.reference_C, celsius);
  c.stator_k_C = table.number_or("stator_k_C", c.stator_k_C, {200.0, 1e12});
  c.rotor_k_C = table.number_or("rotor_k_C", c.rotor_k_C, {200.0, 1e12});
  c.speedup = table.number_or("speedup", c.speedup, {0.0, 1e5});
  // A kilowatt warms the winding by kelvins within a supply period then: beyond it, resistance runs away.
  const double least = std::min({c.stator_J_per_K, c.rotor_J_per_K, c.iron_J_per_K});
  if (any && least < 0.1 * c.speedup)
    table.fail("speedup", "leaves less than 0.1 J/K of a heat capacity",
               "larger capacities or a smaller speedup");
  return std::make_shared<Thermal>(c);
}

}  // namespace imrig::plant
