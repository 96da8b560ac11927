#pragma once
// A table of steady points as a part of the least-squares problem: the machine's steady state with all its
// effects (Newton's method on the derivative, harmonics left out), and the errors of current, power, torque
// over their noise, with exact derivatives by the implicit-function theorem.

#include "estimators/fit/global/record_terms.h"
#include "rig/data/record.h"

namespace imrig::est {

// One sigma of each channel of a table.
struct PointNoise {
  double current_A = 0.0;  // peak
  double power_W = 0.0;
  double torque_Nm = 0.0;
  double speed_rad_s = 0.0;  // passed through the model: at small slip it matters most
  double relative = 0.0;     // of the value, added to each: what a table is good for
};

struct PointPrediction {
  double i_peak_A = 0.0, p_in_W = 0.0, q_var = 0.0, torque_Nm = 0.0, p_out_W = 0.0;
};

// The steady state of the machine with its effects. Throws Error where the point lacks voltage, frequency or
// speed, or where no steady state is found.
PointPrediction predict_steady(const SharedVector<double>& shared, int pole_pairs, const SteadyPoint& point);

// lanes.local is left out: points have no unknowns of their own.
RecordTerms points_terms(const std::vector<SteadyPoint>& points, int pole_pairs, const PointNoise& noise,
                         const SharedVector<double>& shared, const Lanes& lanes);

}  // namespace imrig::est
