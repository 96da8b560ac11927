#include "estimators/fit/global/global_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "estimators/fit/global/settle.h"
#include "estimators/model/effects/registry.h"

namespace imrig::est {

namespace {

constexpr double kBent = 3.0;    // rise of chi2 over its forecast, and beside it
constexpr double kFlat = 1e-11;  // eigenvalue of the scaled normal matrix that is no information

using Indices = std::vector<Eigen::Index>;

// Unknowns that may move: those on a bound with a gradient that pushes outward stay.
Indices movable(const GlobalPoint& at, const Freedom& free, const Eigen::VectorXd& gradient) {
  Indices out;
  for (std::size_t m = 0; m < free.shared.size(); ++m) {
    const Bounds b = free.bounds_of(free.shared[m]);
    const double x = at.shared[free.shared[m]];
    const double g = gradient[static_cast<Eigen::Index>(m)];
    if ((x <= b.low && g > 0.0) || (x >= b.high && g < 0.0)) continue;
    out.push_back(static_cast<Eigen::Index>(m));
  }
  return out;
}

Eigen::MatrixXd part(const Eigen::MatrixXd& whole, const Indices& rows) {
  const auto n = static_cast<Eigen::Index>(rows.size());
  Eigen::MatrixXd out(n, n);
  for (Eigen::Index a = 0; a < n; ++a) {
    for (Eigen::Index b = 0; b < n; ++b)
      out(a, b) = whole(rows[static_cast<std::size_t>(a)], rows[static_cast<std::size_t>(b)]);
  }
  return out;
}

// Step over the shared unknowns, damped in their own scale; directions without information are left alone.
Eigen::VectorXd step_of(const GlobalTerms& terms, const Indices& rows, double damping) {
  Eigen::VectorXd step = Eigen::VectorXd::Zero(terms.gradient.size());
  if (rows.empty()) return step;
  const Eigen::MatrixXd H = part(terms.normal, rows);
  const auto n = H.rows();
  Eigen::VectorXd g(n);
  for (Eigen::Index a = 0; a < n; ++a) g[a] = terms.gradient[rows[static_cast<std::size_t>(a)]];
  const Eigen::VectorXd scale = H.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  Eigen::MatrixXd scaled = scale.asDiagonal() * H * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scaled);
  const Eigen::VectorXd along = eigen.eigenvectors().transpose() * (scale.asDiagonal() * g);
  Eigen::VectorXd y = Eigen::VectorXd::Zero(n);
  for (Eigen::Index a = 0; a < n; ++a) {
    if (eigen.eigenvalues()[a] > kFlat) y[a] = -along[a] / (eigen.eigenvalues()[a] + damping);
  }
  const Eigen::VectorXd d = scale.asDiagonal() * (eigen.eigenvectors() * y);
  for (Eigen::Index a = 0; a < n; ++a) step[rows[static_cast<std::size_t>(a)]] = d[a];
  return step;
}

// A shape that a plainer form held outside its bounds begins where the effect says.
GlobalPoint begun(GlobalPoint at, const Freedom& free) {
  for (const std::size_t e : free.shared) {
    if (e < kBase || shared_parameter(e).role != Role::kShape) continue;
    const EffectParameter& p = shared_parameter(e);
    const Bounds b = free.bounds_of(e);
    double& x = at.shared[e];
    if (x >= b.low && x <= b.high) continue;
    const bool held = x == p.neutral || std::find(p.scan.begin(), p.scan.end(), x) != p.scan.end();
    x = held ? p.start : std::clamp(x, b.low, b.high);
  }
  return at;
}

GlobalPoint moved(const GlobalPoint& from, const Freedom& free, const Eigen::VectorXd& step) {
  GlobalPoint to = from;
  for (std::size_t m = 0; m < free.shared.size(); ++m) {
    const std::size_t entry = free.shared[m];
    const Bounds b = free.bounds_of(entry);
    double x = from.shared[entry] + step[static_cast<Eigen::Index>(m)];
    if (entry < kBase) x = std::clamp(x, from.shared[entry] / 2.0, from.shared[entry] * 2.0);
    to.shared[entry] = std::clamp(x, b.low, b.high);
  }
  return to;
}

// The records' own unknowns follow the shared ones to first order.
void follow(const GlobalProblem& problem, const GlobalTerms& terms, const Freedom& free,
            const std::vector<std::size_t>& which, const GlobalPoint& from, GlobalPoint& to) {
  const auto s = static_cast<Eigen::Index>(free.shared.size());
  Eigen::VectorXd step(s);
  for (std::size_t m = 0; m < free.shared.size(); ++m)
    step[static_cast<Eigen::Index>(m)] = to.shared[free.shared[m]] - from.shared[free.shared[m]];
  for (std::size_t k = 0; k < which.size(); ++k) {
    const auto locals = problem.locals_of(which[k], free.local);
    const auto l = static_cast<Eigen::Index>(locals.size());
    if (l == 0) continue;
    const RecordTerms& r = terms.records[k];
    Eigen::MatrixXd D = r.normal.bottomRightCorner(l, l);
    D.diagonal() *= 1.0 + 1e-10;
    D.diagonal().array() += 1e-12;
    const LocalVector<double>& was = from.local[which[k]];
    const Eigen::VectorXd d =
        bounded_step(D, r.gradient.tail(l) + r.normal.bottomLeftCorner(l, s) * step, locals, was);
    for (std::size_t m = 0; m < locals.size(); ++m)
      to.local[which[k]][locals[m]] = was[locals[m]] + d[static_cast<Eigen::Index>(m)];
  }
}

Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& H, const Indices& rows, Eigen::Index n, Indices* flat) {
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(n, n);
  if (rows.empty()) return out;
  const Eigen::MatrixXd P = part(H, rows);
  const Eigen::VectorXd scale = P.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scale.asDiagonal() * P * scale.asDiagonal());
  Eigen::VectorXd inverse = eigen.eigenvalues();
  for (Eigen::Index a = 0; a < inverse.size(); ++a) {
    if (inverse[a] > kFlat) {
      inverse[a] = 1.0 / inverse[a];
      continue;
    }
    inverse[a] = 0.0;
    for (Eigen::Index b = 0; flat != nullptr && b < inverse.size(); ++b) {
      if (std::abs(eigen.eigenvectors()(b, a)) > 0.3) flat->push_back(rows[static_cast<std::size_t>(b)]);
    }
  }
  const Eigen::MatrixXd C = scale.asDiagonal() * eigen.eigenvectors() * inverse.asDiagonal() *
                            eigen.eigenvectors().transpose() * scale.asDiagonal();
  for (Eigen::Index a = 0; a < P.rows(); ++a) {
    for (Eigen::Index b = 0; b < P.rows(); ++b)
      out(rows[static_cast<std::size_t>(a)], rows[static_cast<std::size_t>(b)]) = C(a, b);
  }
  return out;
}

void add_intervals(const GlobalTerms& terms, GlobalFit& fit) {
  const auto n = terms.gradient.size();
  const Indices rows = movable(fit.at, fit.free, terms.gradient);
  fit.on_bound.assign(fit.free.shared.size(), false);
  for (std::size_t m = 0; m < fit.free.shared.size(); ++m) {
    const Bounds b = fit.free.bounds_of(fit.free.shared[m]);
    const double x = fit.at.shared[fit.free.shared[m]];
    fit.on_bound[m] = x <= b.low || x >= b.high;
  }
  Indices flat;
  fit.noise_covariance = inverse_of(terms.normal, rows, n, &flat);
  for (const Eigen::Index m : flat) fit.flat.push_back(fit.free.shared[static_cast<std::size_t>(m)]);
  Eigen::MatrixXd spread = Eigen::MatrixXd::Zero(n, n);
  for (const Eigen::VectorXd& score : terms.scores) spread += score * score.transpose();
  const double clusters = static_cast<double>(terms.scores.size());
  const double left = clusters - static_cast<double>(rows.size());
  fit.covariance = fit.noise_covariance;
  if (left < 1.0) {
    // Too few records to tell their spread: the misfit itself widens the interval.
    fit.covariance *= std::max(1.0, fit.chi2 / std::max(1.0, fit.dof));
    return;
  }
  const Eigen::MatrixXd robust = (clusters / left) * (fit.noise_covariance * spread * fit.noise_covariance);
  for (Eigen::Index m = 0; m < n; ++m) {
    if (robust(m, m) <= fit.covariance(m, m)) continue;
    const double widen = std::sqrt(robust(m, m) / fit.covariance(m, m));
    fit.covariance.row(m) *= widen;
    fit.covariance.col(m) *= widen;
  }
}

}  // namespace

Bounds Freedom::bounds_of(std::size_t entry) const {
  if (entry < kBase) return base[entry];
  return {shared_parameter(entry).low, shared_parameter(entry).high};
}

std::string GlobalFit::caveat(std::size_t entry) const {
  if (std::find(flat.begin(), flat.end(), entry) != flat.end()) return "not determined by these data";
  const auto found = std::find(free.shared.begin(), free.shared.end(), entry);
  if (found == free.shared.end() || on_bound.empty()) return "";
  return on_bound[static_cast<std::size_t>(found - free.shared.begin())] ? "on a bound of what it can be"
                                                                         : "";
}

double GlobalFit::sigma(std::size_t entry) const {
  if (!caveat(entry).empty()) return kMissing;
  const auto found = std::find(free.shared.begin(), free.shared.end(), entry);
  if (found == free.shared.end() || covariance.size() == 0) return kMissing;
  const auto m = static_cast<Eigen::Index>(found - free.shared.begin());
  return std::sqrt(covariance(m, m));
}

GlobalFit fit_global(const GlobalProblem& problem, const GlobalPoint& start, const Freedom& free,
                     const std::vector<std::size_t>& which, const GlobalFitOptions& options) {
  GlobalFit fit;
  fit.free = free;
  fit.at = begun(start, free);
  GlobalTerms terms = problem.evaluate(fit.at, free, which, options.priors);
  fit.evaluations = 1;
  double damping = 1e-4;
  for (int round = 0; round < options.most_rounds && std::isfinite(terms.chi2); ++round) {
    const Indices rows = movable(fit.at, free, terms.gradient);
    const Eigen::VectorXd step = step_of(terms, rows, damping);
    // A gain that the linearisation forecasts as far too small for another step is not asked for.
    const double forecast = -step.dot(terms.gradient);
    if (round > 0 && damping < 1e-3 && forecast < 0.1 * (options.tolerance * terms.chi2 + options.enough)) {
      fit.converged = true;
      break;
    }
    GlobalPoint next = moved(fit.at, free, step);
    follow(problem, terms, free, which, fit.at, next);
    GlobalTerms there = problem.evaluate(next, free, which, options.priors);
    ++fit.evaluations;
    const double won = terms.chi2 - there.chi2;
    if (!(won > 0.0)) {  // worse, or not a number
      if (std::abs(won) < options.tolerance * terms.chi2) {
        fit.converged = true;
        break;
      }
      damping = std::max(1e-6, 8.0 * damping);
      if (damping > 1e8) break;
      continue;
    }
    fit.at = std::move(next);
    const bool small = won < options.tolerance * there.chi2 + options.enough;
    terms = std::move(there);
    damping *= 0.15;
    if (small) {
      fit.converged = true;
      break;
    }
  }
  fit.chi2 = terms.chi2;
  fit.values = terms.values;
  fit.dof = static_cast<double>(terms.values) - static_cast<double>(free.shared.size());
  for (const std::size_t k : which) fit.dof -= static_cast<double>(problem.locals_of(k, free.local).size());
  if (options.intervals && std::isfinite(terms.chi2)) add_intervals(terms, fit);
  if (options.unbiased && fit.converged && fit.noise_covariance.size() > 0) {
    const Eigen::VectorXd shift = fit.noise_covariance * problem.noise_gradient(fit.at, free.shared, which);
    GlobalPoint next = moved(fit.at, free, shift);
    follow(problem, terms, free, which, fit.at, next);
    // Along a bent valley the straight shift would leave the minimum.
    const double forecast = shift.dot(terms.normal * shift);
    const double rise = problem.evaluate(next, {{}, free.local}, which, options.priors).chi2 - terms.chi2;
    if (rise < kBent * forecast + kBent) fit.at = std::move(next);
  }
  fit.terms = std::move(terms);
  return fit;
}

}  // namespace imrig::est
