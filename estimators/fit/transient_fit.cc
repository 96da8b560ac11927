#include "estimators/fit/transient_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlopt.hpp>

#include "estimators/fit/covariance.h"
#include "estimators/model/simulate.h"

namespace imrig::est {

namespace {

constexpr int kMostEvaluations = 80;
constexpr int kMostPolishSteps = 12;
constexpr double kSettled = 1e-4;    // a step below this part of a standard deviation ends the polishing
constexpr double kOnBound = 1e-4;    // in ln(theta)
constexpr std::size_t kBins = 512;   // score bins a record is cut into
constexpr double kNearEnough = 0.1;  // nrmse at which the nominal needs no rival start
constexpr int kMostMoves = 3;        // of bounds that are guesses

using Theta = MachineParameters<double>;

std::array<double, kCircuit> as_array(const Theta& p) { return {p.R_s, p.R_r, p.L_l, p.L_m}; }
Theta from_array(const std::array<double, kCircuit>& a) { return {a[0], a[1], a[2], a[3]}; }

// The search of one record from one start.
class Search {
 public:
  Search(const RecordProblem& problem, const TransientOptions& options, const Theta& nominal)
      : problem_(problem),
        nominal_(as_array(nominal)),
        bin_(std::max<std::size_t>(1, problem.judged() / kBins)) {
    for (int m = options.fit_R_s ? 0 : 1; m < kCircuit; ++m) free_.push_back(m);
  }

  int evaluations() const { return evaluations_; }

  // NLopt's part. Returns false when it fails outright.
  bool constrained_minimum(Theta& theta) {
    nlopt::opt search(nlopt::LD_SLSQP, static_cast<unsigned>(free_.size()));
    search.set_lower_bounds(std::log(kBoundLow));
    search.set_upper_bounds(std::log(kBoundHigh));
    search.set_ftol_rel(1e-5);
    search.set_xtol_abs(1e-6);
    search.set_maxeval(kMostEvaluations);
    fixed_ = as_array(theta);
    problem_.best_start(theta, scale_);
    if (!(scale_ > 0.0) || !std::isfinite(scale_)) return false;
    search.set_min_objective(&Search::objective, this);
    std::vector<double> x;
    for (const int m : free_)
      x.push_back(std::clamp(std::log(fixed_[index(m)] / nominal_[index(m)]), std::log(kBoundLow),
                             std::log(kBoundHigh)));
    double error = 0.0;
    try {
      search.optimize(x, error);
    } catch (const nlopt::roundoff_limited&) {
      // The best point so far is in x.
    } catch (const std::exception&) {
      return false;
    }
    theta = at(x);
    return std::isfinite(error);
  }

  // Gauss-Newton over the parameters that lie inside their bounds. Returns whether it settled.
  bool polish(Theta& theta, double& error) {
    problem_.best_start(theta, error);
    for (int step = 0; step < kMostPolishSteps; ++step) {
      double part = 0.0;  // of a standard deviation
      const Theta better = stepped(theta, part);
      if (part < kSettled) return true;
      double new_error = 0.0;
      Theta tried = better;
      double length = 1.0;
      for (int half = 0; half < 6; ++half) {
        problem_.best_start(tried, new_error);
        ++evaluations_;
        if (new_error <= error) break;
        length *= 0.5;
        tried = between(theta, better, length);
      }
      if (!(new_error <= error)) return part < 0.05;
      theta = tried;
      error = new_error;
    }
    return false;
  }

  std::array<bool, kCircuit> on_bound(const Theta& theta) const {
    std::array<bool, kCircuit> on{};
    const auto values = as_array(theta);
    for (const int m : free_) {
      const double x = std::log(values[index(m)] / nominal_[index(m)]);
      on[index(m)] = x < std::log(kBoundLow) + kOnBound || x > std::log(kBoundHigh) - kOnBound;
    }
    return on;
  }

 private:
  static std::size_t index(int m) { return static_cast<std::size_t>(m); }

  Theta at(const std::vector<double>& x) const {
    auto values = fixed_;
    for (std::size_t k = 0; k < free_.size(); ++k)
      values[index(free_[k])] = nominal_[index(free_[k])] * std::exp(x[k]);
    return from_array(values);
  }

  static double objective(const std::vector<double>& x, std::vector<double>& gradient, void* self) {
    return static_cast<Search*>(self)->evaluate(x, gradient);
  }

  double evaluate(const std::vector<double>& x, std::vector<double>& gradient) {
    ++evaluations_;
    const Theta theta = at(x);
    double error = 0.0;
    const FluxState<double> start = problem_.best_start(theta, error);
    if (!gradient.empty()) {
      const Linearization here = problem_.linearize(theta, start, problem_.judged());
      const auto values = as_array(theta);
      for (std::size_t k = 0; k < free_.size(); ++k)
        gradient[k] = 2.0 * here.gradient[free_[k]] * values[index(free_[k])] / scale_;
    }
    return error / scale_;
  }

  Theta stepped(const Theta& theta, double& part) {
    ++evaluations_;
    double error = 0.0;
    const FluxState<double> start = problem_.best_start(theta, error);
    const Linearization here = problem_.linearize(theta, start, bin_);
    const auto bound = on_bound(theta);
    std::vector<int> moving;
    for (const int m : free_) {
      if (!bound[index(m)]) moving.push_back(m);
    }
    for (int m = kCircuit; m < kUnknowns; ++m) moving.push_back(m);
    const Unknowns step = -(inverse_over(here.normal, moving) * here.gradient);
    const double variance = here.error / static_cast<double>(2 * problem_.judged());
    part = std::sqrt(std::max(0.0, -step.dot(here.gradient)) / std::max(variance, 1e-300));
    auto values = as_array(theta);
    for (const int m : free_) {
      const double low = nominal_[index(m)] * kBoundLow;
      const double high = nominal_[index(m)] * kBoundHigh;
      values[index(m)] = std::clamp(
          values[index(m)] + std::clamp(step[m], -0.5 * values[index(m)], values[index(m)]), low, high);
    }
    return from_array(values);
  }

  static Theta between(const Theta& a, const Theta& b, double share) {
    return {a.R_s + share * (b.R_s - a.R_s), a.R_r + share * (b.R_r - a.R_r), a.L_l + share * (b.L_l - a.L_l),
            a.L_m + share * (b.L_m - a.L_m)};
  }

  const RecordProblem& problem_;
  std::array<double, kCircuit> nominal_;
  std::array<double, kCircuit> fixed_{};
  std::vector<int> free_;
  std::size_t bin_;
  double scale_ = 1.0;
  int evaluations_ = 0;
};

// Time after which the residual has forgotten itself: three time constants of the stator's transient.
std::size_t memory_bins(const Theta& theta, double sample_time_s, std::size_t bin, std::size_t bins) {
  const double tau = theta.L_l / (theta.R_s + theta.R_r);
  const auto wanted =
      static_cast<std::size_t>(std::ceil(3.0 * tau / (sample_time_s * static_cast<double>(bin)))) + 2;
  return std::clamp<std::size_t>(wanted, 2, std::max<std::size_t>(2, bins / 8));
}

void add_covariance(const RecordProblem& problem, bool fit_R_s, TransientFit& fit) {
  const std::size_t bin = std::max<std::size_t>(1, problem.judged() / kBins);
  const Linearization here = problem.linearize(fit.theta, fit.start, bin);
  std::vector<int> moving;
  for (int m = fit_R_s ? 0 : 1; m < kUnknowns; ++m) moving.push_back(m);
  const Normal inverse = inverse_over(here.normal, moving);
  const std::size_t lags = memory_bins(fit.theta, problem.record().sample_time_s, bin, here.scores.size());
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
    double error = 0.0;
    problem.best_start(theta, error);
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
  double error = 0.0;
  for (int move = 0; move <= (options.bounds_move ? kMostMoves : 0); ++move) {
    Search search(problem, options, nominal);
    const bool found = search.constrained_minimum(fit.theta);
    const bool settled = found && search.polish(fit.theta, error);
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
  double error = 0.0;
  fit.start = problem.best_start(fit.theta, error);
  fit.flux_on_bound = beyond(fit.start.psi_s, kBoundFlux * options.saturation_flux_Wb) ||
                      beyond(fit.start.psi_r, kBoundFlux * options.saturation_flux_Wb);
  fit.nrmse = std::sqrt(error / problem.signal());
  fit.residual_A = std::sqrt(error / static_cast<double>(2 * problem.judged()));
  add_covariance(problem, options.fit_R_s, fit);
  return fit;
}

}  // namespace imrig::est
