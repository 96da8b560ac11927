#include "estimators/fit/transient_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimators/fit/transient_search.h"

namespace imrig::est {

namespace {

constexpr double kNearEnough = 0.1;                       // nrmse at which the nominal needs no rival start
constexpr int kMostMoves = 3;                             // of bounds that are guesses
constexpr double kThin_s = 0.3e-3;                        // sample time of the search's first part
constexpr double kSettled = 0.01, kRoughlySettled = 0.1;  // of a standard deviation
constexpr double kTenth = 0.1;                            // the paper's dy over y
constexpr std::size_t kFewestThin = 1000;

using Theta = MachineParameters<double>;

// Noise, and the estimate freed from what noise on the voltage does to it. A correction larger than a
// standard deviation is no correction.
void add_noise(const RecordProblem& problem, const Linearization& here, const RecordColumns& columns,
               const TransientOptions& options, TransientFit& fit) {
  fit.start = here.start;
  fit.nrmse = std::sqrt(here.error / problem.signal());
  const std::array<double, kCircuit> at{fit.theta.R_s, fit.theta.R_r, fit.theta.L_l, fit.theta.L_m};
  for (std::size_t m = 0; m < at.size(); ++m) {
    const auto k = static_cast<Eigen::Index>(m);
    fit.sensitivity[m] = 0.5 * kTenth * here.normal(k, k) * at[m] * at[m] / problem.signal();
  }
  fit.residual_A = std::sqrt(here.error / static_cast<double>(2 * problem.judged()));
  fit.noise = transient_noise(problem, fit.theta, options.fit_R_s, here, columns, options.noise);
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

// The record at a longer sample time: means of blocks, in the frame, of voltage, current and speed alike,
// which leaves a linear machine's relation between them as it is. Enough to find the neighbourhood; the last
// steps see every sample.
FrameRecord thinned(const FrameRecord& record) {
  const auto by =
      std::min(static_cast<std::size_t>(kThin_s / record.sample_time_s + 1e-9), record.size() / kFewestThin);
  if (by < 2) return record;
  FrameRecord out = record;
  const std::size_t n = record.size() / by;
  out.sample_time_s *= static_cast<double>(by);
  out.judged_from = (record.judged_from + by - 1) / by;
  out.v.assign(n, 0.0), out.i.assign(n, 0.0), out.w_r.assign(n, 0.0);
  const double share = 1.0 / static_cast<double>(by);
  for (std::size_t k = 0; k < n * by; ++k) {
    out.v[k / by] += share * record.v[k];
    out.i[k / by] += share * record.i[k];
    out.w_r[k / by] += share * record.w_r[k];
  }
  return out;
}

// The start that leaves the smallest error.
Theta best_of(const RecordProblem& problem, const TransientOptions& options) {
  Theta best = options.nominal;
  double least = std::numeric_limits<double>::infinity();
  const auto consider = [&](const Theta& theta) {
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

}  // namespace

// One constrained search, with bounds that move along while they are guesses.
TransientFit fit_transient(const FrameRecord& record, const TransientOptions& options) {
  TransientFit fit;
  const FrameRecord thin = thinned(record);
  const RecordProblem quick(thin, false, options.fit_R_s), close(thin, true, options.fit_R_s),
      whole(record, true, options.fit_R_s);
  fit.theta = best_of(quick, options);
  if (!options.fit_R_s) fit.theta.R_s = options.nominal.R_s;
  Theta nominal = options.bounds_move ? fit.theta : options.nominal;
  Linearization here;
  RecordColumns columns;
  for (int move = 0; move <= (options.bounds_move ? kMostMoves : 0); ++move) {
    TransientSearch search(quick, nominal, options.fit_R_s);
    const bool found = search.constrained_minimum(fit.theta);
    if (found && thin.size() < record.size()) search.polish(close, kRoughlySettled, fit.theta, here, nullptr);
    const bool settled = search.polish(whole, kSettled, fit.theta, here, &columns) && found;
    fit.evaluations += search.evaluations();
    fit.on_bound = search.on_bound(fit.theta);
    fit.failure = !found ? "the optimizer failed" : !settled ? "the fit did not settle" : "";
    if (std::none_of(fit.on_bound.begin(), fit.on_bound.end(), [](bool on) { return on; })) break;
    nominal = fit.theta;
  }
  add_noise(whole, here, columns, options, fit);
  fit.flux_on_bound = beyond(fit.start.psi_s, kBoundFlux * options.saturation_flux_Wb) ||
                      beyond(fit.start.psi_r, kBoundFlux * options.saturation_flux_Wb);
  return fit;
}

}  // namespace imrig::est
