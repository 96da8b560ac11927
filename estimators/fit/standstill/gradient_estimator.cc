#include "estimators/fit/standstill/gradient_estimator.h"

#include <algorithm>
#include <cmath>

namespace imrig::est {

void GradientEstimator::step(double u_V, double i_A) {
  const double h_0 = config_.filters.h_0, h_1 = config_.filters.h_1;
  const double square = w_[0] * w_[0] + w_[1] * w_[1] + w_[2] * w_[2] + w_[3] * w_[3];
  const double predicted = c_[0] * w_[0] + c_[1] * w_[1] + c_[2] * w_[2] + c_[3] * w_[3];
  const double pull = config_.gain * (i_A - predicted) / (1.0 + config_.alpha * square);
  const Slopes now{u_V - h_1 * w_[0], u_V - h_0 * w_[1], i_A - h_1 * w_[2], i_A - h_0 * w_[3],
                   pull * w_[0],      pull * w_[1],      pull * w_[2],      pull * w_[3]};
  for (std::size_t k = 0; k < now.size(); ++k) {
    double slope = now[k];
    if (steps_ == 1) slope = (3.0 * now[k] - before_[k]) / 2.0;
    if (steps_ >= 2) slope = (23.0 * now[k] - 16.0 * before_[k] + 5.0 * long_before_[k]) / 12.0;
    (k < 4 ? w_[k] : c_[k - 4]) += config_.step_s * slope;
  }
  long_before_ = before_;
  before_ = now;
  steps_ = std::min(steps_ + 1, 2);
}

GradientEstimator run_gradient(const AxisRecord& record, const GradientConfig& config) {
  GradientEstimator estimator(config);
  const double ratio = config.step_s / record.sample_time_s;
  for (std::size_t m = 0;; ++m) {
    const double at = static_cast<double>(m) * ratio;
    // The nearest sample where the rates fit: no noise is averaged away then.
    const double whole = std::floor(at + 1e-6);
    const auto k = static_cast<std::size_t>(whole);
    if (k + 1 >= record.size()) break;
    const double part = std::max(0.0, at - whole);
    const auto between = [&](const std::vector<double>& x) {
      return part < 1e-5 ? x[k] : x[k] + part * (x[k + 1] - x[k]);
    };
    estimator.step(between(record.u), between(record.i));
  }
  return estimator;
}

}  // namespace imrig::est
