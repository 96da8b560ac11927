#pragma once
// Which points of a plan the rig can carry, and what is to be expected there: current, slip, torque,
// pull-out, generator, time. The motor is known only through a steady-state predictor that the caller hands
// in, so that rig/campaign needs no motor model. Torque balance at the shaft: T(v, f, slip) = load +
// friction(speed), on the branch between no load and pull-out. Friction is the configuration's no-load torque
// at rated speed, taken proportional to speed.

#include <functional>
#include <string>
#include <vector>

#include "rig/base/rig_config.h"
#include "rig/campaign/plan.h"

namespace imrig {

struct SteadyPrediction {
  double current_A = 0.0;  // peak
  double torque_Nm = 0.0;  // electromagnetic, positive when motoring
};

// Steady state at peak phase voltage in V, stator frequency in Hz, slip (0..1].
using SteadyPredictor = std::function<SteadyPrediction(double v_peak_V, double frequency_Hz, double slip)>;

// A point with what was predicted for it. Numbers that have no meaning for its kind are NaN.
struct CheckedPoint {
  PlanPoint point;
  int plan_index = 0;
  double voltage_V = 0.0;  // peak, before the step
  double stepped_V = 0.0;  // peak, after the step
  double load_Nm = 0.0;
  double excitation_A = 0.0;  // field current that gives the load, by the nominal generator
  double slip = std::numeric_limits<double>::quiet_NaN();
  double speed_rpm = std::numeric_limits<double>::quiet_NaN();
  double torque_Nm = std::numeric_limits<double>::quiet_NaN();  // load and friction
  double pull_out_Nm = std::numeric_limits<double>::quiet_NaN();
  double most_Nm = std::numeric_limits<double>::quiet_NaN();  // the largest load the point can carry
  std::string most_by;          // what bounds it: "pull-out", "current", "slip" or "generator"
  double current_A = 0.0;       // peak, steady
  double current_peak_A = 0.0;  // with the step's or the start's transient
  double time_s = 0.0;          // rig time, the way there from the point before it included
  bool feasible = true;
  std::string why;  // why not, in one phrase
};

// In the plan's order; time_s is filled by sequence.h.
std::vector<CheckedPoint> check_points(const Plan& plan, const RigConfig& rig,
                                       const SteadyPredictor& predict);

// Largest torque over slip at (v, f) and the slip where it lies.
struct PullOut {
  double torque_Nm = 0.0;
  double slip = 1.0;
};
PullOut pull_out(const SteadyPredictor& predict, double v_peak_V, double frequency_Hz);

double rated_peak_V(const MotorConfig& motor);  // peak phase voltage of the equivalent star

}  // namespace imrig
