#pragma once
// An improvement as one HTML file that needs nothing else: waterfall, candidates of each step, the model as
// it was beside the one proposed.

#include <string>

#include "estimators/diagnose/diagnose.h"

namespace imrig {

// Writes FOLDER/report.html, whole or not at all; makes the folder. Returns the file's path. Throws Error.
std::string write_improvement_report(const est::Model& current, const est::Improvement& improvement,
                                     const std::string& folder);

}  // namespace imrig
