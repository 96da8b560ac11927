#pragma once
// A speed that was rounded with less noise than a step: while it is held it is off by up to half a step, the same in
// every sample. No average takes that away, and it passes for heat in the rotor. Counts of an encoder move in steps too,
// but the angle that they add up to is right.

#include "rig/data/record.h"

namespace imrig {

// rad/s, mechanical. 0: the speeds of the set's time series do not lie on a grid, or noise carries them across it.
double rounded_speed_step(const DataSet& data);

}  // namespace imrig
