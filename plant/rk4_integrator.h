#pragma once
// y(t + h) = y + h (k1 + 2 k2 + 2 k3 + k4)/6, the classical formula of order four.

#include "plant/integrator.h"

namespace imrig::plant {

class Rk4Integrator final : public Integrator {
 public:
  explicit Rk4Integrator(const Drive& drive) : drive_(drive), n_(drive.size()) {}

  void advance(State& x, double h, bool /*fresh*/) override {
    drive_.derivatives(x.data(), k1_.data());
    stage(x, 0.5 * h, k1_, k2_);
    stage(x, 0.5 * h, k2_, k3_);
    stage(x, h, k3_, k4_);
    for (std::size_t k = 0; k < n_; ++k) x[k] += h / 6.0 * (k1_[k] + 2.0 * (k2_[k] + k3_[k]) + k4_[k]);
  }

 private:
  void stage(const State& x, double h, const State& slope, State& out) {
    for (std::size_t k = 0; k < n_; ++k) at_[k] = x[k] + h * slope[k];
    drive_.derivatives(at_.data(), out.data());
  }

  const Drive& drive_;
  std::size_t n_;
  State at_{}, k1_{}, k2_{}, k3_{}, k4_{};
};

}  // namespace imrig::plant
