#pragma once
// Sums over one channel's errors, and the figures that follow from them.

#include <string>

#include "estimators/diagnose/compare.h"

namespace imrig::est {

// Fills rmse, nrmse, chi2_per_dof and floor from the sums.
void finish(ChannelResult& channel);

// Adds one value: its error, signal and variance from noise (NaN if not known), all squared.
void add_value(ChannelResult& channel, double error2, double signal2, double variance);

}  // namespace imrig::est
