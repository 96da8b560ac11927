#pragma once
// The curve that both saturations use: what a flux of length |psi| adds to the current of a linear
// inductance, relative to that current,
//   g(u) = extra u^n (1 + c) / (1 + c u^n),  u = |psi| / psi_ref
// extra is the share at the reference flux; n sets how sharply the knee comes; c > 0 lets the slope settle
// beyond it (g -> extra (1 + c) / c). The current g(u) psi / L is the gradient of an energy that grows with
// |psi|, so a circuit composed of such curves neither makes nor loses energy.

#include <cmath>

#include "estimators/model/complex_pair.h"

namespace imrig::est {

template <class T>
T saturation_share(const Cx<T>& psi, const T& extra, const T& exponent, const T& settling, const T& psi_ref) {
  using std::exp;
  using std::log;
  const T u2 = norm(psi) / (psi_ref * psi_ref) + 1e-12;
  const T power = exp(0.5 * exponent * log(u2));
  return extra * power * (1.0 + settling) / (1.0 + settling * power);
}

}  // namespace imrig::est
