#pragma once
// The voltage channel's first-order filter, applied to the current, so that both are late and small alike:
//   tau dy/dt = x - y,  x on straight lines between samples, exactly.

#include <cmath>
#include <complex>

namespace imrig::est {

class MatchedFilter {
 public:
  MatchedFilter() = default;
  MatchedFilter(double sample_time_s, double filter_s) : on_(filter_s > 0.0) {
    if (!on_) return;
    const double ratio = sample_time_s / filter_s, slope = -std::expm1(-ratio) / ratio;
    decay_ = std::exp(-ratio);
    old_ = slope - decay_;
    fresh_ = 1.0 - slope;
  }
  void restart() { started_ = false; }
  std::complex<double> take(std::complex<double> x) {
    if (!on_) return x;
    y_ = started_ ? decay_ * y_ + old_ * last_ + fresh_ * x : x;
    started_ = true;
    last_ = x;
    return y_;
  }

 private:
  bool on_ = false, started_ = false;
  double decay_ = 0.0, old_ = 0.0, fresh_ = 1.0;
  std::complex<double> y_, last_;
};

}  // namespace imrig::est
