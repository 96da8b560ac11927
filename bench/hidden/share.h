#pragma once
// A share of runs with the interval that so many runs allow (Wilson 1927, J. Am. Stat. Assoc. 22).

#include <algorithm>
#include <cmath>

namespace imrig::bench {

struct Share {
  int good = 0, of = 0;
  void count(bool yes) { add(yes ? 1 : 0, 1); }
  void add(int more_good, int more) { good += more_good, of += more; }
  double value() const { return of > 0 ? static_cast<double>(good) / of : 0.0; }
  double low() const { return wilson(-1.0); }
  double high() const { return wilson(1.0); }

 private:
  double wilson(double side) const {
    if (of == 0) return side > 0.0 ? 1.0 : 0.0;
    constexpr double z = 1.959964;
    const double n = of, p = value();
    const double middle = p + z * z / (2.0 * n), half = z * std::sqrt(p * (1.0 - p) / n + z * z / (4.0 * n * n));
    return std::clamp((middle + side * half) / (1.0 + z * z / n), 0.0, 1.0);
  }
};

}  // namespace imrig::bench
