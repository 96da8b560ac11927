#pragma once
// The minimum of the global problem inside the bounds of its parameters, by Levenberg's and Marquardt's
// method on the normal equations with the records' own unknowns eliminated. Base parameters stay positive; a
// parameter that lies on a bound and wants beyond it is held there and told.
//
// Intervals come from record to record: the larger of the likelihood's covariance and of the cluster-robust
// one (sandwich with one cluster a record; Liang and Zeger 1986).

#include <functional>
#include <string>
#include <vector>

#include "estimators/fit/global/global_problem.h"

namespace imrig::est {

struct GlobalFit {
  GlobalPoint at;
  Freedom free;
  bool converged = false;
  double chi2 = 0.0;
  std::size_t values = 0;  // real values fitted
  double dof = 0.0;
  Eigen::MatrixXd covariance;        // of the shared unknowns, from record to record
  Eigen::MatrixXd noise_covariance;  // from the declared noise
  GlobalTerms terms;                 // at the minimum
  std::vector<bool> on_bound;        // of the shared unknowns
  std::vector<std::size_t> flat;     // entries that these data do not determine
  int evaluations = 0;

  // NaN when it was not free, lies on a bound, or is not determined by these data.
  double sigma(std::size_t shared_entry) const;
  // "on a bound of what it can be", "not determined by these data", or nothing to say.
  std::string caveat(std::size_t shared_entry) const;
};

struct GlobalFitOptions {
  std::vector<Prior> priors;
  int most_rounds = 40;
  double tolerance = 1e-7;  // of chi2, and
  double enough = 1e-3;     // of chi2 in absolute terms: a step that wins less is the last
  bool intervals = true;
  bool unbiased = false;  // move by what noise of the voltage does to the estimate; asks for intervals
};

// which: the entries that are fitted.
GlobalFit fit_global(const GlobalProblem& problem, const GlobalPoint& start, const Freedom& free,
                     const std::vector<std::size_t>& which, const GlobalFitOptions& options = {});

}  // namespace imrig::est
