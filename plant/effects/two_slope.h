#pragma once
// An isotropic curve of two slopes with a smooth knee: what saturation adds to a current, as a function of a
// flux vector psi of length x.
//   h(x) = s x (1 - 2K/S),  S = sqrt((x-k)^2 + w^2) + sqrt((x+k)^2 + w^2),  k = K sqrt(1 - r^2),  w = K r.
// Slope 0 at the origin, rising all the way to s; the asymptote s (x - K) leaves the axis at the knee K. The
// softness r (0 sharp .. 1) rounds it. It is the gradient of the convex energy H(x), in closed form, so
// whatever is composed of such curves neither makes nor loses energy. Odd and analytic in x, hence smooth as
// a vector. Near a point h(x)/x goes as a cubic in x^2: its nearest singularity, where the product of both
// roots vanishes, is rho = 2 K^2 r sqrt(1 - r^2) away in x^2 (K^2 from r^2 = 1/2 on), and what the cubic
// leaves of h goes with s K (d/rho)^4; within reach_ it is below kNear_A (tested).

#include <cmath>

namespace imrig::plant {

class TwoSlope {
 public:
  struct Tangent {
    double secant;  // h(x)/x
    double rank;    // (h'(x) - h(x)/x)/x^2: the Jacobian of the vector is secant I + rank psi psi^T
  };

  struct Near {  // coefficients around x2
    double x2 = -INFINITY, a = 0.0, b = 0.0, c = 0.0, d = 0.0;
  };
  static constexpr double kNear_A = 1e-5;

  TwoSlope() = default;  // nothing
  // s >= 0, knee > 0, softness in (0, 1).
  TwoSlope(double s, double knee, double softness)
      : s_(s), K_(knee), r2_(softness * softness), k_(knee * std::sqrt(1.0 - r2_)) {
    const double rho = K_ * K_ * (r2_ < 0.5 ? 2.0 * std::sqrt(r2_ * (1.0 - r2_)) : 1.0);
    if (!none()) reach_ = rho * std::pow(32.0 * kNear_A / (s_ * K_), 0.25);
  }

  bool none() const { return s_ == 0.0; }
  double knee() const { return K_; }
  double final_slope() const { return s_; }

  double secant(double x2) const { return s_ * (1.0 - 2.0 * K_ / std::sqrt(square(x2, product(x2)))); }

  Tangent tangent(double x2) const {
    const double P = product(x2), S2 = square(x2, P), S = std::sqrt(S2), f = 2.0 * K_ * s_ / (S * S2 * P);
    return {s_ - f * S2 * P, f * (S2 - 4.0 * k_ * k_)};
  }

  // The same from `near`, which moves here where it does not reach.
  Tangent tangent(double x2, Near& near) const {
    double x = x2 - near.x2;
    if (!(std::abs(x) <= reach_)) expand(x2, near), x = 0.0;
    return {near.a + x * (near.b + x * (near.c + x * near.d)),
            2.0 * near.b + x * (4.0 * near.c + 6.0 * x * near.d)};
  }

  // Bound on |h''|.
  double curvature() const { return none() ? 0.0 : s_ / (2.0 * k_ * std::sqrt(r2_)); }

  // Integral of h from 0 to x.
  double energy(double x) const {
    if (none()) return 0.0;
    return s_ *
           (0.5 * x * x - K_ / (2.0 * k_) * (primitive(x + k_) - primitive(x - k_) - 2.0 * primitive(k_)));
  }

 private:
  // Product and sum of the two distances; only the square of x enters.
  double product(double x2) const {
    const double K2 = K_ * K_, away = x2 - K2;
    return std::sqrt(away * away + 4.0 * r2_ * K2 * x2);
  }
  double square(double x2, double P) const { return 2.0 * (x2 + K_ * K_ + P); }
  double primitive(double u) const {
    const double w = K_ * std::sqrt(r2_);
    return 0.5 * (u * std::sqrt(u * u + w * w) + w * w * std::asinh(u / w));
  }

  // Taylor's coefficients, P'' P = 1 - P'^2, S^2' = 2 (1 + P').
  void expand(double x2, Near& near) const {
    const double P = product(x2), P1 = (x2 - K_ * K_ + 2.0 * r2_ * K_ * K_) / P, P2 = (1.0 - P1 * P1) / P;
    const double v = 1.0 / square(x2, P), g = 2.0 * K_ * s_ * std::sqrt(v);  // s - h/x
    const double q1 = 2.0 * (1.0 + P1) * v, q2 = 2.0 * P2 * v, q3 = -6.0 * P1 * P2 / P * v;
    near.x2 = x2, near.a = s_ - g, near.b = 0.5 * g * q1;
    near.c = 0.25 * g * (q2 - 1.5 * q1 * q1);
    near.d = g / 12.0 * (q3 - 4.5 * q1 * q2 + 3.75 * q1 * q1 * q1);
  }

  double s_ = 0.0, K_ = 1.0, r2_ = 0.25, k_ = 0.8660254037844386, reach_ = 0.0;
};

}  // namespace imrig::plant
