#include "estimators/fit/inverse.h"

#include <Eigen/Eigenvalues>
#include <cmath>

namespace imrig::est {

namespace {
constexpr double kBlind = 1e-13;
}

Normal inverse_over(const Normal& normal, const std::vector<int>& free) {
  const auto n = static_cast<Eigen::Index>(free.size());
  const auto at = [&free](Eigen::Index a) { return free[static_cast<std::size_t>(a)]; };
  Eigen::MatrixXd part(n, n);
  Eigen::VectorXd scale(n);
  for (Eigen::Index a = 0; a < n; ++a) {
    const double own = normal(at(a), at(a));
    scale[a] = own > 0.0 ? 1.0 / std::sqrt(own) : 1.0;
  }
  for (Eigen::Index a = 0; a < n; ++a) {
    for (Eigen::Index b = 0; b < n; ++b) part(a, b) = normal(at(a), at(b)) * scale[a] * scale[b];
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(part);
  const Eigen::VectorXd values = solver.eigenvalues().cwiseMax(kBlind);
  const Eigen::MatrixXd inverse =
      solver.eigenvectors() * values.cwiseInverse().asDiagonal() * solver.eigenvectors().transpose();
  Normal out = Normal::Zero();
  for (Eigen::Index a = 0; a < n; ++a) {
    for (Eigen::Index b = 0; b < n; ++b) out(at(a), at(b)) = inverse(a, b) * scale[a] * scale[b];
  }
  return out;
}

}  // namespace imrig::est
