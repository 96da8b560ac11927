#pragma once
// A plan against a rig: what check prints and what run runs. Here the campaign's predictor is made from the
// estimators' base machine and the rig's nominal motor.

#include <string>
#include <vector>

#include "rig/campaign/sequence.h"

namespace imrig {

SteadyPredictor predictor_of(const MotorConfig& motor);

struct CheckedPlan {
  Plan plan;
  std::vector<CheckedPoint> in_order;    // feasible, in the order they are run
  std::vector<CheckedPoint> infeasible;  // in the plan's order
  double time_s() const;                 // rig time
};
CheckedPlan check_plan(const Plan& plan, const RigConfig& rig);

std::string check_table(const CheckedPlan& checked);
std::string check_json(const CheckedPlan& checked);

}  // namespace imrig
