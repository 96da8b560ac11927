#pragma once
// The on-line estimator of Fang, Lin and Wang 2005, as published:
//   dw_1/dt = u - h_1 w_1, dw_2/dt = u - h_0 w_2, dw_3/dt = i - h_1 w_3, dw_4/dt = i - h_0 w_4
//   e = (i - c.w)/(1 + alpha w.w),   dc/dt = Gamma e w                       (normalized gradient, equations
//   15 to 17)
// all by the 3-step Adams-Bashforth rule at 0.3 ms:
//   x_{k+1} = x_k + h (23 f_k - 16 f_{k-1} + 5 f_{k-2})/12,
// started with one Euler and one 2-step step. Everything begins at zero. The paper prints neither Gamma nor
// alpha; Gamma = 10^4 and alpha = 1 are stable for a motor of its size: the rule's limit is Gamma |w|^2/(1 +
// alpha |w|^2) < 0.545/h. Biased: the noise of i stands in w_3 and w_4 too. standstill_fit.h is the rig's own
// estimator.

#include <array>

#include "estimators/fit/standstill/axis_record.h"
#include "estimators/fit/standstill/parametric.h"

namespace imrig::est {

struct GradientConfig {
  StandstillFilters filters;
  double step_s = 0.3e-3;
  double gain = 1e4;  // Gamma, the same for all four
  double alpha = 1.0;
};

class GradientEstimator {
 public:
  explicit GradientEstimator(const GradientConfig& config) : config_(config) {}
  // One sample, step_s after the one before. No allocation.
  void step(double u_V, double i_A);
  const RegressionVector& c() const { return c_; }
  std::optional<TCircuit> circuit() const { return circuit_of(c_, config_.filters); }

 private:
  using Slopes = std::array<double, 8>;  // of w, then of c
  GradientConfig config_;
  std::array<double, 4> w_{};
  RegressionVector c_{};
  Slopes before_{}, long_before_{};
  int steps_ = 0;
};

// The record sampled every step_s (straight lines between its own samples), once from begin to end.
GradientEstimator run_gradient(const AxisRecord& record, const GradientConfig& config = {});

}  // namespace imrig::est
