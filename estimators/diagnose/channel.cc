#include "estimators/diagnose/channel.h"

#include <cmath>

namespace imrig::est {

void add_value(ChannelResult& channel, double error2, double signal2, double variance) {
  const bool first = channel.values == 0;
  channel.error2 += error2;
  channel.signal2 += signal2;
  channel.noise2 = (first ? 0.0 : channel.noise2) + variance;  // one unknown value makes the sum unknown
  channel.chi2 = (first ? 0.0 : channel.chi2) + error2 / variance;
  ++channel.values;
}

void add_sums(ChannelResult& channel, const ChannelResult& more) {
  const bool first = channel.values == 0;
  channel.unit = more.unit;
  channel.error2 += more.error2;
  channel.signal2 += more.signal2;
  channel.noise2 = (first ? 0.0 : channel.noise2) + more.noise2;
  channel.chi2 = (first ? 0.0 : channel.chi2) + more.chi2;
  channel.values += more.values;
  channel.dof += more.dof;
}

void finish(ChannelResult& channel) {
  if (channel.values == 0) return;
  channel.rmse = std::sqrt(channel.error2 / static_cast<double>(channel.values));
  if (channel.signal2 > 0.0) {
    channel.nrmse = std::sqrt(channel.error2 / channel.signal2);
    channel.floor = std::sqrt(channel.noise2 / channel.signal2);
  }
  if (channel.dof > 0.0) channel.chi2_per_dof = channel.chi2 / channel.dof;
}

}  // namespace imrig::est
