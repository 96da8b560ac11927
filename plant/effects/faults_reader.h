#pragma once
// [effects.eccentricity], [effects.stick_slip], [effects.interbar_current], [effects.coupling_torsion]

#include <memory>

#include "plant/effects/coupling_torsion.h"
#include "plant/effects/eccentricity.h"
#include "plant/effects/interbar_current.h"
#include "plant/effects/stick_slip.h"
#include "rig/base/config_reader.h"

namespace imrig::plant {

inline std::shared_ptr<const Effect> read_eccentricity(const ConfigReader& table) {
  Eccentricity::Config c;
  c.static_share = table.number_or("static_share", 0.0, {0.0, 0.9});
  c.dynamic_share = table.number_or("dynamic_share", 0.0, {0.0, 0.9});
  if (c.static_share + c.dynamic_share > 0.9) {
    table.fail("dynamic_share", "lets the rotor touch the stator", "static and dynamic together at most 0.9");
  }
  return std::make_shared<Eccentricity>(c);
}

inline std::shared_ptr<const Effect> read_stick_slip(const ConfigReader& table) {
  StickSlip::Config c;
  c.coulomb_Nm = table.number_or("coulomb_Nm", 0.0, {0.0, 1e3});
  c.break_away_Nm = table.number_or("break_away_Nm", c.coulomb_Nm, {0.0, 1e3});
  if (c.break_away_Nm < c.coulomb_Nm) table.fail("break_away_Nm", "is below coulomb_Nm", "equal or more");
  c.stribeck_rad_s = table.number_or("stribeck_rad_s", c.stribeck_rad_s, {0.01, 100.0});
  return std::make_shared<StickSlip>(c);
}

inline std::shared_ptr<const Effect> read_interbar_current(const ConfigReader& table) {
  InterbarCurrent::Config c;
  c.inductance_H = table.number_or("inductance_H", 0.0, {0.0, 10.0});
  c.resistance_ohm = table.number_or("resistance_ohm", c.resistance_ohm, {1e-4, 1e4});
  return std::make_shared<InterbarCurrent>(c);
}

inline std::shared_ptr<const Effect> read_coupling_torsion(const ConfigReader& table) {
  CouplingTorsion::Config c;
  c.stiffness_Nm = table.number_or("stiffness_Nm", 0.0, {0.0, 1e8});
  c.damping_Nms = table.number_or("damping_Nms", 0.0, {0.0, 1e4});
  c.generator_J_kgm2 = table.number_or("generator_J_kgm2", c.generator_J_kgm2, {1e-6, 1e4});
  return std::make_shared<CouplingTorsion>(c);
}

}  // namespace imrig::plant
