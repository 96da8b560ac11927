#pragma once
// Do the accepted parameters hold still? The data are halved by each operating condition (frequency, flux,
// slip, current, temperature, order); the amplitudes that each half would give follow to first order from the
// normal equations. A parameter that differs between halves by far more than its noise stands for something
// else.

#include <string>
#include <vector>

#include "estimators/diagnose/missing/trial.h"

namespace imrig::est {

struct Unstable {
  std::string parameter;  // "core_loss.eddy_S"
  std::string condition;  // "f_Hz"
  double low = 0.0, high = 0.0;
};

std::vector<Unstable> unstable(const GlobalProblem& problem, const Trial& trial);

}  // namespace imrig::est
