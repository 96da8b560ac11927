#pragma once
// How well effects that a model lacks could be seen, on the data at hand and with each of some experiments:
//   d = sqrt(lambda)/2,  lambda = m^2 M
// M: information on its amplitude with everything that is free projected out (score_test.h), m: the amplitude
// that matters to an engineer.

#include <vector>

#include "estimators/diagnose/next/imagine.h"

namespace imrig::est {

struct Visibility {
  std::vector<std::size_t> effects;       // those that have a shared amplitude and found room
  std::vector<double> now;                // d of each
  std::vector<std::vector<double>> with;  // of each experiment
};

Visibility visibility(const GlobalProblem& problem, const WorkingModel& base,
                      const std::vector<std::size_t>& effects, const std::vector<Experiment>& menu);

}  // namespace imrig::est
