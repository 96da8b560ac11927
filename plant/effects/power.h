#pragma once
// x^p for x >= 0 and a p that is known beforehand; the exponents of loss laws in closed form, since the
// general power costs more than the rest of such a law.

#include <cmath>

namespace imrig::plant {

class Power {
 public:
  explicit Power(double exponent)
      : exponent_(exponent), half_(exponent * 2.0 == std::floor(exponent * 2.0) ? exponent * 2.0 : -1.0) {}

  double operator()(double x) const {
    if (half_ == 0.0) return 1.0;
    if (half_ == 1.0) return std::sqrt(x);
    if (half_ == 2.0) return x;
    if (half_ == 3.0) return x * std::sqrt(x);
    if (half_ == 4.0) return x * x;
    return std::pow(x, exponent_);
  }

 private:
  double exponent_, half_;
};

}  // namespace imrig::plant
