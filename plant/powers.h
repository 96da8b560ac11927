#pragma once
// Where the energy is and goes, in W and J, at the end of the last step. Over any time of the base machine
//   motor + field = stator_copper + rotor_copper + iron + drag + armature + field_copper + load + d(magnetic
//   + kinetic + generator)/dt.
// Heat by kind: stator_copper + rotor_copper + iron + stray + friction. Magnetic energy includes saturation and
// what effects store.

namespace imrig::plant {

struct Powers {
  double motor_W = 0.0;  // electrical, into the motor's terminals
  double stator_copper_W = 0.0;
  double rotor_copper_W = 0.0;
  double iron_W = 0.0;
  double stray_W = 0.0;
  double air_gap_shaft_W = 0.0;  // torque x speed
  double drag_W = 0.0;      // all that brakes the shaft: friction and what stray loss takes from it
  double friction_W = 0.0;  // of it, without stray loss
  double generator_shaft_W = 0.0;  // taken from the shaft
  double field_W = 0.0;            // electrical, from the supply
  double field_copper_W = 0.0;
  double armature_W = 0.0;
  double load_W = 0.0;      // in the resistor box
  double magnetic_J = 0.0;  // motor
  double kinetic_J = 0.0;
  double generator_J = 0.0;
};

}  // namespace imrig::plant
