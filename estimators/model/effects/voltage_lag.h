#pragma once
// The voltage channels lag the current channels (filter, sampling order, wrong time constant in the file):
// the winding's voltage was ahead of what was recorded, to first order v + lag dv/dt.

#include "estimators/model/base_machine.h"
#include "estimators/model/effects/effect.h"

namespace imrig::est {

template <class T>
class VoltageLag : public EffectLaw<T> {
 public:
  static constexpr EffectParameter kShared[] = {{"lag_s", "s", Role::kAmplitude, 0.0, -2e-3, 2e-3, 2e-6}};
  static constexpr std::size_t kForm0[] = {0};
  static constexpr EffectForm kForms[] = {{"lag", kForm0, false, false}};
  static constexpr EffectInfo kInfo = {"voltage_lag",
                                       "The voltage channels lag the current channels by a fixed time",
                                       "v = v_given + lag dv/dt",
                                       "sensor chain; facts of measurement, not of the motor",
                                       "frequency sweep with a reference channel; swap channels",
                                       Needs::kSeries,
                                       kForms,
                                       kShared};

  VoltageLag(const T* p, const T*) : p_(p), active_(live(p, 1)) {}

  void voltage(Cx<T>& v, const Cx<T>&, const Instant& at) const {
    if (!active_) return;
    v = v + Cx<T>(p_[0] * at.voltage_rate.real(), p_[0] * at.voltage_rate.imag());
  }

 private:
  const T* p_;
  bool active_;
};

}  // namespace imrig::est
