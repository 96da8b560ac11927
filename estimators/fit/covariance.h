#pragma once
// Covariance of a least-squares estimate whose residuals are coloured (voltage noise passes through the
// machine before it shows):
//   C = N^-1 S N^-1, N = J' J, S = sum over lags of w(lag) Gamma(lag), Gamma the autocovariance of the scores
//   J' r,
// with Parzen's window over binned scores (Newey and West 1987; Andrews 1991), and 1/(1 - 0.75 lags/bins) for
// the mean that the fit removed.

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "estimators/fit/record_problem.h"

namespace imrig::est {

// Inverse of the normal matrix over the free unknowns, zero elsewhere; directions that the record does not
// see at all (relative eigenvalue below 1e-13 after scaling) get a very large variance, never a small one.
Normal inverse_over(const Normal& normal, const std::vector<int>& free);

// S of the scores; `lags` in bins.
Normal long_run_covariance(const std::vector<Unknowns>& scores, std::size_t lags);

}  // namespace imrig::est
