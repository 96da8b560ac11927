#include "estimators/fit/maps/linear_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>

#include "estimators/fit/student_t.h"
#include "rig/base/error.h"

namespace imrig::est {

double LinearFit::t_975() const { return student_t_975(degrees_of_freedom); }

LinearFit linear_fit(const Eigen::MatrixXd& A, const Eigen::VectorXd& y, const Eigen::VectorXd& sigma,
                     const std::vector<std::size_t>& cluster) {
  const Eigen::Index n = A.rows(), k = A.cols();
  const Eigen::VectorXd weight = sigma.cwiseInverse();
  const Eigen::MatrixXd whitened = weight.asDiagonal() * A;
  const Eigen::VectorXd scale = whitened.colwise().norm().cwiseMax(1e-300).cwiseInverse();
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(whitened * scale.asDiagonal());
  if (n < k || qr.rank() < k) throw Error("linear fit", "has fewer independent rows than unknowns");
  LinearFit fit;
  fit.c = scale.asDiagonal() * qr.solve(weight.asDiagonal() * y);
  fit.residual = y - A * fit.c;
  const Eigen::VectorXd whitened_residual = weight.asDiagonal() * fit.residual;
  fit.rms = std::sqrt(whitened_residual.squaredNorm() / static_cast<double>(n));
  const Eigen::MatrixXd scaled = whitened * scale.asDiagonal();
  const Eigen::MatrixXd B = scale.asDiagonal() * (scaled.transpose() * scaled).inverse() * scale.asDiagonal();

  std::map<std::size_t, Eigen::VectorXd> scores;
  for (Eigen::Index row = 0; row < n; ++row) {
    const auto [place, fresh] = scores.try_emplace(cluster[static_cast<std::size_t>(row)], Eigen::VectorXd::Zero(k));
    place->second += whitened.row(row).transpose() * whitened_residual[row];
  }
  Eigen::MatrixXd meat = Eigen::MatrixXd::Zero(k, k);
  for (const auto& [name, score] : scores) meat += score * score.transpose();
  const double G = static_cast<double>(scores.size());
  fit.degrees_of_freedom = std::max(1.0, G - static_cast<double>(k));
  const double spare = std::max(1.0, static_cast<double>(n - k));
  const double factor = G > 1.0 ? G / (G - 1.0) * (static_cast<double>(n) - 1.0) / spare : 1.0;
  fit.covariance = factor * B * meat * B;
  // Few clusters that happen to agree must not say more than their own noise.
  const Eigen::VectorXd least = B.diagonal();
  for (Eigen::Index j = 0; j < k; ++j) {
    if (fit.covariance(j, j) >= least[j] || !(least[j] > 0.0)) continue;
    const double up = fit.covariance(j, j) > 0.0 ? std::sqrt(least[j] / fit.covariance(j, j)) : 0.0;
    fit.covariance.row(j) *= up;
    fit.covariance.col(j) *= up;
    fit.covariance(j, j) = least[j];
  }
  return fit;
}

}  // namespace imrig::est
