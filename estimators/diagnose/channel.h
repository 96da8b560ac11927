#pragma once
// Sums over one channel's errors, and the figures that follow from them.
// Channels: current_A (space vector, peak; of points: line, rms), input_power_W; torque_Nm (shaft; of series:
// means of steady stretches) where it was measured; of points also power_factor and output_power_W.

#include <map>
#include <string>

#include "rig/data/record.h"

namespace imrig::est {

struct ChannelResult {
  double rmse = kMissing;
  double nrmse = kMissing;
  double chi2_per_dof = kMissing;
  double floor = kMissing;
  std::string unit;
  // What pooling needs: sums over the values compared, in the unit squared.
  double error2 = 0.0;
  double signal2 = 0.0;
  double noise2 = kMissing;  // expected of error2 from noise alone
  double chi2 = kMissing;
  std::size_t values = 0;  // samples or points
  double dof = 0.0;        // real values less the initial states estimated
};

using Channels = std::map<std::string, ChannelResult>;

// Fills rmse, nrmse, chi2_per_dof and floor from the sums.
void finish(ChannelResult& channel);

// Adds one value: its error, signal and variance from noise (NaN if not known), all squared.
void add_value(ChannelResult& channel, double error2, double signal2, double variance);

// Adds the sums of another channel of the same unit; finish() afterwards.
void add_sums(ChannelResult& channel, const ChannelResult& more);

}  // namespace imrig::est
