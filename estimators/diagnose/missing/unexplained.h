#pragma once
// What is left when the library holds no explanation: how large, on what it depends, and its lines.

#include "estimators/diagnose/diagnose.h"

namespace imrig::est {

Unexplained describe_unexplained(const GlobalProblem& problem, const Trial& trial);

}  // namespace imrig::est
