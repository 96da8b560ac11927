#pragma once
// What white noise of the voltage does to a standstill fit: its power in the predicted current and the pull
// of that.

#include <vector>

#include "estimators/fit/standstill/standstill_problem.h"

namespace imrig::est::standstill {

// |G|^2 of standstill_fit.h, 1/(ohm^2 s), and its gradient by ln theta.
struct PowerGain {
  double value = 0.0;
  Vector4 slope = Vector4::Zero();
};
PowerGain noise_power_gain(const MachineParameters<double>& theta);

// sigma_v^2 from the residual: its covariance at a lag where the current channel's own noise has no part any
// more, over the machine's response to white noise there.
double voltage_variance(const AxisRecord& record, const MachineParameters<double>& theta,
                        const std::vector<double>& residual);

}  // namespace imrig::est::standstill
