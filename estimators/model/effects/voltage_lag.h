#pragma once
// The voltage channels lag the current channels (filter, sampling order, wrong time constant in the file):
// the winding's voltage was ahead of what was recorded, to second order v + lag d/dt (v - filter dv/dt). What
// the second order is depends on where the lag comes from: a first-order filter of tau + lag that is taken
// for one of tau has filter = tau, a pure delay has -lag/2, a filter that nobody knows of has 0.

#include "estimators/model/base_machine.h"
#include "estimators/model/effects/effect.h"

namespace imrig::est {

template <class T>
class VoltageLag : public EffectLaw<T> {
 public:
  static constexpr EffectParameter kShared[] = {{"lag_s", "s", Role::kAmplitude, 0.0, -2e-3, 2e-3, 2e-6},
                                                {"filter_s", "s", Role::kShape, 0.0, -1e-3, 5e-3, 2e-5}};
  static constexpr std::size_t kForm0[] = {0};
  static constexpr std::size_t kForm1[] = {0, 1};
  static constexpr EffectForm kForms[] = {{"lag", kForm0, false, false},
                                          {"lag, with its second order", kForm1, false, true}};
  static constexpr EffectInfo kInfo = {"voltage_lag",
                                       "The voltage channels lag the current channels by a fixed time",
                                       "v = v_given + lag d/dt (v_given - filter dv_given/dt)",
                                       "sensor chain; facts of measurement, not of the motor",
                                       "frequency sweep with a reference channel; swap channels",
                                       Needs::kSeries,
                                       kForms,
                                       kShared};

  VoltageLag(const T* p, const T*) : p_(p), active_(live(p, 1)) {}

  void voltage(Cx<T>& v, const Cx<T>&, const Instant& at) const {
    if (!active_) return;
    // Its own derivative as in steady state: where the voltage steps, the second order is small and short.
    const std::complex<double> rate = at.voltage_rate, bend = std::complex<double>(0.0, at.w_k) * rate;
    const T second = p_[0] * p_[1];
    v = v + Cx<T>(p_[0] * rate.real() - second * bend.real(), p_[0] * rate.imag() - second * bend.imag());
  }

 private:
  const T* p_;
  bool active_;
};

}  // namespace imrig::est
