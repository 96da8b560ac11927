#pragma once
// An improvement as the terminal shows it: candidates, waterfall, model.

#include "estimators/diagnose/diagnose.h"

namespace imrig {

void print_improvement(const est::Model& current, const est::Improvement& improvement);

}  // namespace imrig
