#include "estimators/fit/covariance.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace imrig::est {

namespace {

double parzen(double x) {
  if (x < 0.5) return 1.0 - 6.0 * x * x * (1.0 - x);
  if (x < 1.0) return 2.0 * (1.0 - x) * (1.0 - x) * (1.0 - x);
  return 0.0;
}

}  // namespace

Normal inverse_over(const Normal& normal, const std::vector<int>& free) {
  const auto n = static_cast<Eigen::Index>(free.size());
  Eigen::MatrixXd part(n, n);
  Eigen::VectorXd scale(n);
  for (Eigen::Index a = 0; a < n; ++a) {
    const double own = normal(free[static_cast<std::size_t>(a)], free[static_cast<std::size_t>(a)]);
    scale[a] = own > 0.0 ? 1.0 / std::sqrt(own) : 1.0;
  }
  for (Eigen::Index a = 0; a < n; ++a) {
    for (Eigen::Index b = 0; b < n; ++b) {
      part(a, b) =
          normal(free[static_cast<std::size_t>(a)], free[static_cast<std::size_t>(b)]) * scale[a] * scale[b];
    }
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(part);
  const Eigen::VectorXd values = solver.eigenvalues().cwiseMax(1e-13);
  const Eigen::MatrixXd inverse =
      solver.eigenvectors() * values.cwiseInverse().asDiagonal() * solver.eigenvectors().transpose();
  Normal out = Normal::Zero();
  for (Eigen::Index a = 0; a < n; ++a) {
    for (Eigen::Index b = 0; b < n; ++b) {
      out(free[static_cast<std::size_t>(a)], free[static_cast<std::size_t>(b)]) =
          inverse(a, b) * scale[a] * scale[b];
    }
  }
  return out;
}

Normal long_run_covariance(const std::vector<Unknowns>& scores, std::size_t lags) {
  const std::size_t bins = scores.size();
  Normal sum = Normal::Zero();
  for (const auto& score : scores) sum += score * score.transpose();
  for (std::size_t lag = 1; lag < lags && lag < bins; ++lag) {
    Normal at_lag = Normal::Zero();
    for (std::size_t k = lag; k < bins; ++k) at_lag += scores[k] * scores[k - lag].transpose();
    sum += parzen(static_cast<double>(lag) / static_cast<double>(lags)) * (at_lag + at_lag.transpose());
  }
  const double share = std::min(0.5, 0.75 * static_cast<double>(lags) / static_cast<double>(bins));
  return sum / (1.0 - share);
}

}  // namespace imrig::est
