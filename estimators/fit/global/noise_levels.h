#pragma once
// Noise of the channels: declared, or seen in the data. What a signal that is smooth in the supply's frame
// does from sample to sample is noise: the second difference of white noise has six times its variance. The
// median over stretches keeps steps and edges out.

#include "estimators/fit/global/whitener.h"
#include "rig/data/record.h"

namespace imrig::est {

// A declared level is not believed when the data show more than so many times as much.
inline constexpr double kBelieved = 1.1;

struct NoiseEstimate {
  NoiseLevels levels;            // what to reckon with; electrical speed
  NoiseLevels seen;              // from the data
  bool declared = false;         // the current's noise was declared
  double declared_factor = 1.0;  // seen over declared noise of the current; 1 where it was not declared
};

// records: of the set, in its frame and not thinned is best; those given are used as they are.
NoiseEstimate noise_levels(const DataSet& data);

}  // namespace imrig::est
