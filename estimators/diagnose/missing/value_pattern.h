#pragma once
// Values that an effect has for each record (a temperature nobody measured), against the conditions of the
// records. Heat comes with time and history; values that follow what the motor does at that very moment (slip
// frequency, flux, frequency) along a curve are the sign of another law than heat.
//   y_k = a + b x_k + c x_k^2 + rest,  share = 1 - Var(rest) / Var(y), for the parabola's three freedoms
//   corrected

#include <string>
#include <vector>

#include "estimators/diagnose/missing/trial.h"

namespace imrig::est {

struct ValuePattern {
  std::string effect;
  std::string condition;  // of record_conditions
  double share = 0.0;     // of the values' variance, that the condition explains
  double by_heat =
      0.0;  // the same of what heats and when: current, torque, measured temperature, the records' order
};

// Whether they follow what the motor does at that moment, and more than they follow what heats.
bool follows(const ValuePattern& pattern);

// For each active effect with a value a record: the condition among frequency, flux and slip that explains
// most.
std::vector<ValuePattern> value_patterns(const GlobalProblem& problem, const Trial& trial);

}  // namespace imrig::est
