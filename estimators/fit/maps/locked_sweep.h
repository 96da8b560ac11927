#pragma once
// Rotor resistance against slip frequency from locked-like sweeps at several rotor temperatures (Proca and
// Keyhani 2002, section V-C, figure 8): at standstill the slip frequency is the supply's, and with a = Re Z -
// R_s and x = w L_m
//   R_r = x (x - sqrt(x^2 - 4 a^2)) / (2 a),   L_l = (Im Z - x R_r^2 / (R_r^2 + x^2)) / w
// (the observer of the paper's appendix at s = 1). Over all sweeps
//   R_r = R_1g + d_g (t - t_g) + k_6 w_s
// with one R_1 per sweep g (its temperature), a drift d_g in time where the sweep is long enough (a rotor that
// cools meanwhile), one k_6, equal weights; intervals from record to record. The straight line is the paper's
// form; what it leaves is printed, and deep_bar.h follows the bend. Where a sweep's R_1 is known against temperature,
//   R_1(T) = R_1 (1 + per_K (T - T_0)) with the winding's temperature, a proxy of the cage's; R_1 is the bent curve's end at
// w_s = 0 where there is one, else the line's.

#include <string>
#include <vector>

#include "estimators/fit/maps/deep_bar.h"
#include "estimators/fit/maps/resistance_line.h"
#include "estimators/fit/maps/steady_phasor.h"

namespace imrig::est {

struct LockedPoint {
  std::size_t record = 0;
  std::size_t sweep = 0;
  double w_s = kMissing;  // rad/s
  double R_r_ohm = kMissing;
  double L_l_H = kMissing;
  double stator_C = kMissing;
  double time_s = kMissing;
  double current_A = kMissing;  // peak
  std::string left_out;
};

struct LockedSweep {
  Parameter R_1;      // ohm, of the line, in the middle of the sweep
  Parameter R_1_bar;  // ohm, of the bent curve
  double stator_C = kMissing;
  double current_A = kMissing;  // peak, mean
  std::size_t records = 0;
};

struct LockedResult {
  std::string failure;
  Parameter k_6;               // ohm s
  std::vector<LockedSweep> sweeps;
  Parameter R_1;               // at reference_C; without value where the temperatures do not spread
  Parameter per_K;             // relative to R_1
  double reference_C = kMissing;
  double line_misfit_ohm = kMissing;  // rms of what the straight line leaves
  DeepBar bar;
  std::vector<LockedPoint> points;
  std::vector<std::string> notes;
};

// R_s: at a temperature. L_m: of the unsaturated machine; infinite neglects the magnetizing branch.
LockedResult fit_locked_sweeps(const DataSet& data, const std::vector<std::size_t>& records,
                               const ResistanceLine& R_s, double L_m, double gain_sigma);

}  // namespace imrig::est
