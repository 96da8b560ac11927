#include "estimators/fit/global/noise_bias.h"

#include "estimators/model/effects/registry.h"

namespace imrig::est {

Eigen::VectorXd noise_gradient(const DrivenRecord& record, const Whitener& whitener, int steps,
                               const SharedVector<double>& shared, const std::vector<std::size_t>& entries,
                               const NoiseLevels& noise) {
  Eigen::VectorXd out = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(entries.size()));
  if (!(noise.voltage_V > 0.0)) return out;
  DrivenRecord pulse = record;
  std::fill(pulse.frame.v.begin(), pulse.frame.v.end(), 0.0);
  std::fill(pulse.frame.i.begin(), pulse.frame.i.end(), 0.0);
  std::fill(pulse.voltage_rate.begin(), pulse.voltage_rate.end(), 0.0);
  pulse.torque.clear();
  // Where the filter has settled.
  pulse.frame.v[pulse.size() / 3] = 1.0;
  SharedVector<double> bare = shared;
  for (std::size_t e = kBase; e < kShared; ++e) bare[e] = shared_parameter(e).neutral;
  const Lanes base{{0, 1, 2, 3}, {}};
  const RecordTerms terms = record_terms(pulse, whitener, steps, bare, neutral_local(), base);
  const double judged = static_cast<double>(record.size() - record.frame.judged_from);
  // A pulse of either component.
  const double weight = 2.0 * judged * noise.voltage_V * noise.voltage_V / record.thinned;
  for (std::size_t m = 0; m < entries.size(); ++m) {
    if (entries[m] < kBase)
      out[static_cast<Eigen::Index>(m)] = weight * terms.gradient[static_cast<Eigen::Index>(entries[m])];
  }
  return out;
}

}  // namespace imrig::est
