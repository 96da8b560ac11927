#pragma once
// The curve that both saturations use: what a flux of length |psi| adds to the current of a linear
// inductance, relative to that current,
//   g(u) = extra s(u) / s(1),  s(u) = (1 - o) s_n(b u) + o s_2(b u),  s_m(x) = 1 - (1 + x^m)^(-1/m),
//   u = |psi| / psi_ref
// Up to the knee psi_ref/b the iron asks for next to no current; beyond it the iron's flux stays and the
// rest goes through air, so the current runs along a second, steeper line. n sets how sharply it bends, extra
// is the share at the reference flux. Iron is never quite linear below its knee: its onset goes with the
// square of the flux, as every smooth curve's does, while the knee may be far sharper; o is the part of the
// curve that begins so. b -> 0 puts the knee out of reach: the power law extra u^n. The current g(u) psi / L
// is the gradient of an energy that grows with |psi|, so a circuit composed of such curves neither makes nor
// loses energy.

#include <cmath>

#include "estimators/model/complex_pair.h"
#include "estimators/model/effects/scalar.h"

namespace imrig::est {

template <class T>
class SaturationCurve {
 public:
  SaturationCurve() = default;  // none
  SaturationCurve(const T& extra, const T& exponent, const T& bend, const T& psi_ref_Wb,
                  const T& onset = T(0.0))
      : exponent_(exponent),
        inverse_ref2_(1.0 / (psi_ref_Wb * psi_ref_Wb)),
        bent_(value_of(bend) != 0.0),
        early_(bent_ && (value_of(onset) != 0.0 || has_derivative(onset))) {
    if (bent_) knee_ = power_of(bend * bend);
    scale_ = bent_ ? T(extra / levelled(knee_)) : extra;
    if (!early_) return;
    knee2_ = bend * bend;
    const T sharp = knee_ * levelled(knee_) / exponent_, soft = from_square(knee2_);
    const T whole = (1.0 - onset) * sharp + onset * soft;
    scale_ = scale_ * ((1.0 - onset) * sharp / whole);
    early_scale_ = extra * onset / whole;
  }

  T share(const Cx<T>& psi) const {
    const T u2 = norm(psi) * inverse_ref2_ + kLeast, power = power_of(u2);
    if (!bent_) return scale_ * power;
    const T share = scale_ * power * levelled(T(knee_ * power));
    return early_ ? T(share + early_scale_ * from_square(T(knee2_ * u2))) : share;
  }

  struct Tangent {
    T share, slope;  // slope: d share / d |psi|^2, 1/Wb^2
  };
  Tangent tangent(const Cx<T>& psi) const {
    using std::exp;
    using std::log1p;
    const T u2 = norm(psi) * inverse_ref2_ + kLeast, power = power_of(u2);
    const T steep = 0.5 * exponent_ * scale_ * power * inverse_ref2_ / u2;
    if (!bent_) return {scale_ * power, steep};
    const T y = knee_ * power;
    Tangent out{scale_ * power * levelled(y), steep * exp(-(1.0 / exponent_ + 1.0) * log1p(y))};
    if (!early_) return out;
    const T y2 = knee2_ * u2;
    out.share = out.share + early_scale_ * from_square(y2);
    out.slope = out.slope + 0.5 * early_scale_ * knee2_ * inverse_ref2_ * exp(-1.5 * log1p(y2));
    return out;
  }

 private:
  static constexpr double kLeast = 1e-12;  // of u^2: no logarithm of nothing
  static constexpr double kSeries = 1e-7;

  T power_of(const T& squared) const {
    using std::exp;
    using std::log;
    return exp(0.5 * exponent_ * log(squared));
  }
  // n s / (b u)^n with y = (b u)^n: 1 at y = 0.
  T levelled(const T& y) const {
    using std::expm1;
    using std::log1p;
    if (value_of(y) < kSeries) return 1.0 - 0.5 * y * (1.0 + 1.0 / exponent_);
    return -expm1(-log1p(y) / exponent_) * exponent_ / y;
  }

  // s_2 of the square of its argument.
  static T from_square(const T& y) {
    using std::sqrt;
    const T root = sqrt(1.0 + y);
    return y / (root * (1.0 + root));
  }

  T exponent_{1.0}, inverse_ref2_{1.0};
  bool bent_ = false, early_ = false;
  T knee_{}, scale_{}, knee2_{}, early_scale_{};
};

}  // namespace imrig::est
