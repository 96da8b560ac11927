#pragma once
// Braking torque of the nominal load generator in steady state: a synchronous generator without saliency that
// feeds a resistor box.
//
//   T = (3/2) p E^2 (R_a + R_load) / (w |Z|^2),  E = w k i_f,  Z = R_a + R_load + j w L_s,  w = p * shaft
//   speed (electrical)
//
// k: peak stator flux linkage per ampere of field current. Assumes no saturation, no iron loss, a settled
// field current. In w the torque has its greatest value where w L_s = R_a + R_load. Source: phasor diagram of
// the round-rotor machine (E = (R + jX) I, P = (3/2) R |I|^2), peak values.

#include "rig/base/rig_config.h"

namespace imrig {

// N m, against the rotation; 0 at standstill. speed_rpm: mechanical, either sign.
double generator_torque_Nm(const GeneratorConfig& generator, double speed_rpm, double field_A);

// A >= 0 that gives torque_Nm >= 0 at this speed; infinite at standstill for a torque above 0.
double field_current_for_torque_A(const GeneratorConfig& generator, double speed_rpm, double torque_Nm);

// N m: the most this field current gives at any speed; infinite where L_s is 0.
double greatest_torque_Nm(const GeneratorConfig& generator, double field_A);

}  // namespace imrig
