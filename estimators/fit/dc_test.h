#pragma once
// R_s from direct current through the standing machine, equation (1) of Proca and Keyhani 2002: with A and C
// on plus and B on minus,
//   R_s = (2/3) V_AB / I_B,
// which as space vectors is R_s = Re(v i*) / |i|^2 for any direction of the current. The zeros of the
// channels come from the samples with the gates off (where the record has them); each level of current counts
// with its settled end only; with two levels or more a straight line |v| = R_s |i| + v_0 leaves offsets and
// device drops out of the slope. Assumes standstill and a winding that does not heat during the record.

#include <string>
#include <vector>

#include "rig/data/record.h"

namespace imrig::est {

// The settled mean of one level of current.
struct DcLevel {
  double current_A = 0.0;  // |i|
  double voltage_V = 0.0;  // part of v along i
  double sigma_V = 0.0;    // of the voltage at this current, both channels' noise
};

struct DcResult {
  std::string failure;  // empty when R_s was found
  double R_s_ohm = kMissing;
  double sigma_ohm = kMissing;
  double v_0_V = 0.0;               // intercept; 0 when there was one level
  double degrees_of_freedom = 0.0;  // of sigma_ohm
  double stator_C = kMissing;
  std::vector<DcLevel> levels;
  std::vector<std::string> notes;
};

DcResult fit_dc(const TimeSeries& series);

}  // namespace imrig::est
