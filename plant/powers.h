#pragma once
// Where the energy is and goes, in W and J, at the end of the last step. Over any time
//   motor + field = stator_copper + rotor_copper + iron + stray + friction + armature + generator_core
//   + generator_friction + field_copper + load + d(magnetic + kinetic + generator)/dt.
// drag + coupling may stand for stray + friction, where no effect lends the shaft magnetic energy
// (eccentricity). Magnetic energy includes saturation and what effects store, a twisted shaft among them.

namespace imrig::plant {

struct Powers {
  double motor_W = 0.0;  // electrical, into the motor's terminals
  double stator_copper_W = 0.0;
  double rotor_copper_W = 0.0;
  double iron_W = 0.0;
  double stray_W = 0.0;
  double air_gap_shaft_W = 0.0;  // torque x speed
  double drag_W = 0.0;      // all that brakes the motor's shaft: friction and what stray loss takes from it
  double friction_W = 0.0;  // heat of bearings, fan and coupling: without stray loss
  double coupling_W = 0.0;  // of it, heat in a coupling that twists; not in drag_W
  double generator_shaft_W = 0.0;  // taken from the shaft, rotational losses included
  double generator_core_W = 0.0, generator_friction_W = 0.0;  // its rotational losses
  double field_W = 0.0;                                       // electrical, from the supply
  double field_copper_W = 0.0;
  double armature_W = 0.0;
  double load_W = 0.0;      // in the resistor box
  double magnetic_J = 0.0;  // motor
  double kinetic_J = 0.0;
  double generator_J = 0.0;
};

}  // namespace imrig::plant
