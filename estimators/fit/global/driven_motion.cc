#include "estimators/fit/global/driven_motion.h"

#include "estimators/model/effects/registry.h"

namespace imrig::est {

bool has_deep_layer(const SharedVector<double>& shared, const LocalVector<double>& local, const Lanes& lanes) {
  using Jet = ceres::Jet<double, 1>;
  SharedVector<Jet> seeded;
  for (std::size_t k = 0; k < kShared; ++k) seeded[k] = Jet(shared[k]);
  for (const std::size_t e : lanes.shared) seeded[e].v[0] = 1.0;
  LocalVector<Jet> own;
  for (std::size_t k = 0; k < kLocal; ++k) own[k] = Jet(local[k]);
  for (const std::size_t e : lanes.local) own[e].v[0] = 1.0;
  return EffectMachine<Jet>(seeded, own).layered();
}

double deep_layer_rate(const SharedVector<double>& shared) {
  return EffectMachine<double>(shared, {}).layer_rate();
}

}  // namespace imrig::est
