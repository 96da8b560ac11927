#pragma once
// The excitation supply as its registers see it: what a client has asked for, and what the supply measures at its terminals.

namespace imrig::plant {

struct ExcitationCommand {
  double set_V = 0.0;
  double set_A = 0.0;
  bool output_on = false;
  double ovp_V = 0.0;  // over-voltage and over-current protection levels
  double ocp_A = 0.0;
};

struct ExcitationReadback {
  double V = 0.0;  // at the terminals
  double A = 0.0;
  bool constant_current = false;  // which of the two set-points limits now
  int protection = 0;             // 0 none, 1 over-voltage, 2 over-current
};

}  // namespace imrig::plant
