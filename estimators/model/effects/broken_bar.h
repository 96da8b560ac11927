#pragma once
// Broken rotor bar: the cage's resistance is not the same along all directions of the rotor,
//   drop = R_r (i_r + beta i_r*) in the rotor's frame.
// The rotor's angle at the start of a record is not known, so beta is complex and local: |beta| should come
// out the same in every record.

#include "estimators/model/base_machine.h"
#include "estimators/model/effects/effect.h"

namespace imrig::est {

template <class T>
class BrokenBar : public EffectLaw<T> {
 public:
  static constexpr EffectParameter kLocal[] = {{"real", "1", Role::kAmplitude, 0.0, -0.9, 0.9, 0.005},
                                               {"imaginary", "1", Role::kAmplitude, 0.0, -0.9, 0.9, 0.005}};
  static constexpr EffectForm kForms[] = {{"by record", {}, true, false}};
  static constexpr EffectInfo kInfo = {
      "broken_bar",
      "A rotor bar is broken: lines at (1 +- 2s) f that grow with load",
      "drop = R_r (i_r + beta e^{2 j theta_r} i_r*)",
      "Filippetti, Franceschini, Tassoni and Vas 1998, IEEE Trans. Industrial Electronics",
      "change the load: the line follows the slip",
      Needs::kSeries,
      kForms,
      {},
      kLocal};

  BrokenBar(const T*, const T* q) : q_(q), active_(live(q, 2)) {}

  void rotor_asymmetry(Cx<T>& extra, const Cx<T>& i_r, const Instant& at) const {
    if (!active_) return;
    const std::complex<double> twice = at.rotor_turn * at.rotor_turn;
    extra = extra + Cx<T>(q_[0], q_[1]) * Cx<T>(T(twice.real()), T(twice.imag())) * conj(i_r);
  }

 private:
  const T* q_;
  bool active_;
};

}  // namespace imrig::est
