#pragma once
// The excitation supply of the load generator as its registers see it.

namespace imrig::plant {

// Set-points. A protection level that the output passes switches it off until output_on is withdrawn; a level
// that is not positive is none.
struct ExcitationCommand {
  double set_V = 0.0;
  double set_A = 0.0;
  bool output_on = false;
  double ovp_V = 0.0;
  double ocp_A = 0.0;
};

// What the supply's own meters show.
struct ExcitationReadback {
  double V = 0.0;  // at the terminals
  double A = 0.0;
  bool constant_current = false;
  bool output_on = false;  // false also after a trip
  bool tripped_ovp = false;
  bool tripped_ocp = false;
};

}  // namespace imrig::plant
