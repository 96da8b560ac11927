#pragma once
// What a wanted shaft torque asks of the excitation. The nominal generator itself is rig/base/generator.h:
// round rotor on a resistor box, steady state, T = (3/2) p E^2 R / (w |Z|^2); no saturation, no iron loss, a
// settled field current.

#include "rig/base/rig_config.h"

namespace imrig {

// N m: the most this field current gives at any speed, reached where w L_s = R_a + R_load:
// T_max = (3/4) p (k i_f)^2 / L_s. Infinite where L_s is 0.
double greatest_torque_Nm(const GeneratorConfig& generator, double field_A);

// Field current in A for torque_Nm at a mechanical speed of either sign, held to most_A; so is the answer at
// standstill.
double field_A_for_load(const GeneratorConfig& generator, double speed_rpm, double torque_Nm, double most_A);

}  // namespace imrig
