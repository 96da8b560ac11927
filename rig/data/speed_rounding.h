#pragma once
// A speed that was rounded with less noise than a step: while it is held it is off by up to half a step, the
// same in every sample. No average takes that away, and it passes for heat in the rotor. Counts of an encoder
// move in steps too, but the angle that they add up to is right; set-points of a simulation are held exactly.

#include <vector>

#include "rig/data/record.h"

namespace imrig {

struct SpeedRounding {
  double step_rad_s = 0.0;  // mechanical; 0: the set's speeds were not rounded
  double sigma_rad_s =
      0.0;  // of a speed that is held: step / sqrt(12), less where noise carries it across steps
  std::vector<bool> of_record;  // one for each record of the set; tables, shafts at rest and finer speeds: no
};

// People round to 1, 2, 2.5 or 5 of a decimal unit: steps from 0.1 to 10 rpm and 0.01 to 1 rad/s are looked
// for, in the time series. A few values off the grid (filled cells) do not count. Speeds that never move are
// taken for set-points where they all are whole multiples of five steps, or the step would be larger than 1
// rpm.
SpeedRounding speed_rounding(const DataSet& data);

}  // namespace imrig
