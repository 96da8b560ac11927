#pragma once
// The first-order filter before the voltage converters: tau dy/dt = u - y, G(s) = 1/(1 + s tau), on all three
// phases alike and therefore on the space vector. Solved exactly for an input that is constant, or runs
// straight, over a stretch of length h:
//   y(h) = u_1 - m tau + (y_0 - u_0 + m tau) exp(-h/tau),   m = (u_1 - u_0)/h.

#include <cmath>
#include <complex>

namespace imrig::plant {

class VoltageFilter {
 public:
  explicit VoltageFilter(double time_constant_s) : tau_(time_constant_s) {}

  void advance(std::complex<double> u_0, std::complex<double> u_1, double h) {
    if (h <= 0.0) return;
    if (tau_ <= 0.0) {
      y_ = u_1;
      return;
    }
    if (h != h_) {
      h_ = h;
      decay_ = std::exp(-h / tau_);
    }
    const std::complex<double> lag = (u_1 - u_0) * (tau_ / h);
    y_ = u_1 - lag + (y_ - u_0 + lag) * decay_;
  }
  std::complex<double> output() const { return y_; }

 private:
  double tau_;
  double h_ = -1.0, decay_ = 0.0;
  std::complex<double> y_ = 0.0;
};

}  // namespace imrig::plant
