#pragma once
// Sensitivity of the current's error to a parameter at a steady point, (7)-(9) of Proca and Keyhani 2002:
//   e^2 = (1/2) |I(y + dy) - I(y)|^2,   S_y = (e^2 / dy) (y / I),   dy = y / 10
// divided once more by I, so that it has no unit: S_y / I = (e / I)^2 / (dy / y). A record whose S_y / I lies
// below kLeastSensitivity says next to nothing of y through its steady state.
// The paper turned this into one number, 2 % of slip: R_r and L_l from slips above it, L_m from those below.

#include <string>
#include <vector>

#include "estimators/model/base_machine.h"

namespace imrig::est {

inline constexpr double kLeastSensitivity = 1e-3;

struct Sensitivity {
  double R_r = 0.0, L_l = 0.0, L_m = 0.0;  // S_y / I
  double of(const std::string& parameter) const;
};

Sensitivity sensitivity_at(const MachineParameters<double>& machine, double w_e, double slip);

// Figure 4: slips from 0 to 10 %.
struct SensitivityCurve {
  double f_Hz = 0.0;
  std::vector<double> slip;
  std::vector<Sensitivity> value;
};
SensitivityCurve sensitivity_curve(const MachineParameters<double>& machine, double f_Hz);

}  // namespace imrig::est
