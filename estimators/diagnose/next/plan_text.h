#pragma once
// An experiment as a campaign plan (docs/campaigns.md): TOML that imrig campaign check and run take.

#include <string>

#include "estimators/diagnose/next/experiment.h"

namespace imrig::est {

// why: one sentence, printed as a comment. name: of the data set it makes.
std::string plan_text(const Experiment& experiment, const RigRange& range,
                      const MachineParameters<double>& motor, int repeats, const std::string& why);

}  // namespace imrig::est
