#pragma once
// Weighted linear least squares y = A c whose covariance comes from cluster to cluster (CR1):
//   c = (A' W A)^-1 A' W y,   cov = f B (sum_g A_g' W_g r_g r_g' W_g A_g) B,   B = (A' W A)^-1,
//   f = G/(G-1) (n-1)/(n-k)
// A cluster is a record, or whatever else shares its errors. Never smaller than what the given sigmas say.
// Source: Cameron and Miller 2015, A practitioner's guide to cluster-robust inference.

#include <Eigen/Core>
#include <vector>

namespace imrig::est {

struct LinearFit {
  Eigen::VectorXd c;
  Eigen::MatrixXd covariance;
  double degrees_of_freedom = 0.0;  // clusters less coefficients, at least 1
  Eigen::VectorXd residual;         // y - A c
  double rms = 0.0;                 // of the residual, weighted, in units of its sigma
  double t_975() const;             // half width of a 95 % interval over its sigma
};

// sigma: per row, > 0. cluster: per row, any integers. Throws Error when A has not full rank.
LinearFit linear_fit(const Eigen::MatrixXd& A, const Eigen::VectorXd& y, const Eigen::VectorXd& sigma,
                     const std::vector<std::size_t>& cluster);

}  // namespace imrig::est
