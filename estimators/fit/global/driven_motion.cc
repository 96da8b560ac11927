#include "estimators/fit/global/driven_motion.h"

#include "estimators/model/effects/registry.h"

namespace imrig::est {

bool has_deep_layer(const SharedVector<double>& shared, const std::vector<std::size_t>& entries) {
  using Jet = ceres::Jet<double, 1>;
  SharedVector<Jet> seeded;
  for (std::size_t k = 0; k < kShared; ++k) seeded[k] = Jet(shared[k]);
  for (const std::size_t e : entries) seeded[e].v[0] = 1.0;
  const LocalVector<Jet> local{};
  return EffectMachine<Jet>(seeded, local).layered();
}

double deep_layer_rate(const SharedVector<double>& shared) {
  return EffectMachine<double>(shared, {}).layer_rate();
}

}  // namespace imrig::est
