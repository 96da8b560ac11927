#pragma once
// Steady stretches of a record as operating points, for a first guess of the circuit. The record is cut into
// equal windows; one counts as steady when its speed and the admittance of its two halves agree. Admittance
// from products, Y = sum i v* / sum |v|^2, which needs no exact frequency; the frequency from the phase drift
// of the whole window.

#include <vector>

#include "estimators/model/frame_record.h"
#include "rig/data/record.h"

namespace imrig::est {

// Speed in the points is counted in the direction of the field: positive when the rotor turns with it.
std::vector<SteadyPoint> steady_windows(const FrameRecord& record, int pole_pairs);

// Mean conditions over the judged samples, for the report: frequency of the field (Hz, signed), slip, rms of
// |v| and |i|.
struct MeanConditions {
  double f_Hz = kMissing;
  double slip = kMissing;
  double v_peak_V = kMissing;
  double i_peak_A = kMissing;
};
MeanConditions mean_conditions(const FrameRecord& record);

}  // namespace imrig::est
