#pragma once
// Noise of the channels: declared, or seen in the data. What a signal that is smooth in the supply's frame
// does from sample to sample is noise: the second difference of white noise has six times its variance. The
// median over stretches keeps steps and edges out.
//
// Coloured noise hides from that, and averages of neighbours do not lose as much of it as the fit believes. Where
// the set holds records of constant current, the scatter of their averages tells what is left of it.

#include "estimators/fit/global/whitener.h"
#include "rig/data/record.h"

namespace imrig::est {

// A declared level is not believed when the data show so many times more or less.
inline constexpr double kBelieved = 1.1;

struct NoiseEstimate {
  NoiseLevels levels;            // what to reckon with; electrical speed
  NoiseLevels seen;              // from the data, from sample to sample
  double colour = 1.0;           // what averages of the current keep over what they would keep of white noise
  bool declared = false;         // the current's noise was declared
  double declared_factor = 1.0;  // seen over declared noise of the current; 1 where it was not declared or cannot be seen
};

// records: of the set, in its frame and not thinned is best; those given are used as they are.
NoiseEstimate noise_levels(const DataSet& data);

}  // namespace imrig::est
