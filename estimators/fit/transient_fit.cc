#include "estimators/fit/transient_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimators/fit/covariance.h"
#include "estimators/fit/transient_search.h"
#include "estimators/model/simulate.h"

namespace imrig::est {

namespace {

constexpr double kNearEnough = 0.1;  // nrmse at which the nominal needs no rival start
constexpr int kMostMoves = 3;        // of bounds that are guesses

using Theta = MachineParameters<double>;

// Time after which the residual has forgotten itself: three time constants of the stator's transient.
std::size_t memory_bins(const Theta& theta, double sample_time_s, std::size_t bin, std::size_t bins) {
  const double tau = theta.L_l / (theta.R_s + theta.R_r);
  const auto wanted =
      static_cast<std::size_t>(std::ceil(3.0 * tau / (sample_time_s * static_cast<double>(bin)))) + 2;
  return std::clamp<std::size_t>(wanted, 2, std::max<std::size_t>(2, bins / 8));
}

void add_covariance(const RecordProblem& problem, bool fit_R_s, TransientFit& fit) {
  const Linearization here = problem.linearize(fit.theta);
  fit.start = here.start;
  fit.nrmse = std::sqrt(here.error / problem.signal());
  fit.residual_A = std::sqrt(here.error / static_cast<double>(2 * problem.judged()));
  std::vector<int> moving;
  for (int m = fit_R_s ? 0 : 1; m < kUnknowns; ++m) moving.push_back(m);
  const Normal inverse = inverse_over(here.normal, moving);
  const std::size_t lags =
      memory_bins(fit.theta, problem.record().sample_time_s, problem.bin(), here.scores.size());
  const Normal covariance = inverse * long_run_covariance(here.scores, lags) * inverse;
  fit.covariance = covariance.topLeftCorner<kCircuit, kCircuit>();
  if (!fit_R_s) fit.per_R_s = -(inverse * here.normal.col(0)).head<kCircuit>();
}

bool beyond(const Cx<double>& flux, double bound) {
  return std::abs(flux.re) > bound || std::abs(flux.im) > bound;
}

// The start that leaves the smallest error.
Theta best_of(const FrameRecord& record, const TransientOptions& options) {
  Theta best = options.nominal;
  double least = std::numeric_limits<double>::infinity();
  const auto consider = [&](const Theta& theta) {
    const RecordProblem problem(record, steps_per_sample(theta, record));
    const double error = problem.error(theta);
    if (!(error < least)) return false;
    least = error;
    best = theta;
    return error < kNearEnough * kNearEnough * problem.signal();
  };
  if (consider(options.nominal)) return best;
  for (const auto& start : options.starts) consider(start);
  return best;
}

// One constrained search with bounds that move along while they are guesses.
void search_from(const RecordProblem& problem, const TransientOptions& options, Theta nominal,
                 TransientFit& fit) {
  for (int move = 0; move <= (options.bounds_move ? kMostMoves : 0); ++move) {
    TransientSearch search(problem, nominal, options.fit_R_s);
    const bool found = search.constrained_minimum(fit.theta);
    const bool settled = found && search.polish(fit.theta);
    fit.evaluations += search.evaluations();
    fit.on_bound = search.on_bound(fit.theta);
    fit.failure = !found ? "the optimizer failed" : !settled ? "the fit did not settle" : "";
    if (std::none_of(fit.on_bound.begin(), fit.on_bound.end(), [](bool on) { return on; })) return;
    nominal = fit.theta;
  }
}

}  // namespace

TransientFit fit_transient(const FrameRecord& record, const TransientOptions& options) {
  TransientFit fit;
  fit.theta = best_of(record, options);
  if (!options.fit_R_s) fit.theta.R_s = options.nominal.R_s;
  const Theta nominal = options.bounds_move ? fit.theta : options.nominal;
  int steps = steps_per_sample(fit.theta, record);
  search_from(RecordProblem(record, steps), options, nominal, fit);
  if (steps_per_sample(fit.theta, record) > steps) {  // the answer is faster than the start
    steps = steps_per_sample(fit.theta, record);
    search_from(RecordProblem(record, steps), options, nominal, fit);
  }
  const RecordProblem problem(record, steps);
  add_covariance(problem, options.fit_R_s, fit);
  fit.flux_on_bound = beyond(fit.start.psi_s, kBoundFlux * options.saturation_flux_Wb) ||
                      beyond(fit.start.psi_r, kBoundFlux * options.saturation_flux_Wb);
  return fit;
}

}  // namespace imrig::est
