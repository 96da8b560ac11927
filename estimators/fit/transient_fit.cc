#include "estimators/fit/transient_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimators/fit/transient_search.h"
#include "estimators/model/simulate.h"

namespace imrig::est {

namespace {

constexpr double kNearEnough = 0.1;  // nrmse at which the nominal needs no rival start
constexpr int kMostMoves = 3;        // of bounds that are guesses

using Theta = MachineParameters<double>;

// Noise, and the estimate freed from what noise on the voltage does to it. A correction larger than a
// standard deviation is no correction.
void add_noise(const RecordProblem& problem, const TransientOptions& options, TransientFit& fit) {
  const Linearization here = problem.linearize(fit.theta);
  fit.start = here.start;
  fit.nrmse = std::sqrt(here.error / problem.signal());
  fit.residual_A = std::sqrt(here.error / static_cast<double>(2 * problem.judged()));
  fit.noise = transient_noise(problem, fit.theta, options.fit_R_s, options.noise);
  const std::array<double Theta::*, kCircuit> places{&Theta::R_s, &Theta::R_r, &Theta::L_l, &Theta::L_m};
  for (std::size_t m = options.fit_R_s ? 0 : 1; m < places.size(); ++m) {
    const auto k = static_cast<Eigen::Index>(m);
    const double sigma = std::sqrt(fit.noise.covariance(k, k));
    if (!fit.on_bound[m]) fit.theta.*places[m] -= std::clamp(fit.noise.bias[k], -sigma, sigma);
  }
}

bool beyond(const Cx<double>& flux, double bound) {
  return std::abs(flux.re) > bound || std::abs(flux.im) > bound;
}

// The start that leaves the smallest error.
Theta best_of(const FrameRecord& record, const TransientOptions& options) {
  Theta best = options.nominal;
  double least = std::numeric_limits<double>::infinity();
  const auto consider = [&](const Theta& theta) {
    const RecordProblem problem(record, steps_per_sample(theta, record), false);
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
void search_from(const FrameRecord& record, int steps, const TransientOptions& options, Theta nominal,
                 TransientFit& fit) {
  const RecordProblem quick(record, steps, false);
  const RecordProblem whole(record, steps, true);
  for (int move = 0; move <= (options.bounds_move ? kMostMoves : 0); ++move) {
    TransientSearch search(quick, whole, nominal, options.fit_R_s);
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
  search_from(record, steps, options, nominal, fit);
  if (steps_per_sample(fit.theta, record) > steps) {  // the answer is faster than the start
    steps = steps_per_sample(fit.theta, record);
    search_from(record, steps, options, nominal, fit);
  }
  const RecordProblem problem(record, steps, true);
  add_noise(problem, options, fit);
  fit.flux_on_bound = beyond(fit.start.psi_s, kBoundFlux * options.saturation_flux_Wb) ||
                      beyond(fit.start.psi_r, kBoundFlux * options.saturation_flux_Wb);
  return fit;
}

}  // namespace imrig::est
