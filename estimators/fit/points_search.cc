#include "estimators/fit/points_search.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <nlopt.hpp>

namespace imrig::est {

namespace {

using Theta = MachineParameters<double>;
using Values = std::array<double, 4>;

constexpr int kMostEvaluations = 300;
constexpr int kMostPolishSteps = 40;
constexpr double kSettled = 1e-5;  // of a standard deviation
constexpr double kOnBound = 1e-3;  // in ln(theta)

Values as_array(const Theta& p) { return {p.R_s, p.R_r, p.L_l, p.L_m}; }
Theta from_array(const Values& a) { return {a[0], a[1], a[2], a[3]}; }
std::size_t index(int m) { return static_cast<std::size_t>(m); }
Eigen::Index row(std::size_t k) { return static_cast<Eigen::Index>(k); }

}  // namespace

PointsSearch::PointsSearch(const PointsProblem& problem, bool fit_R_s) : problem_(problem) {
  for (int m = fit_R_s ? 0 : 1; m < 4; ++m) free_.push_back(m);
  double Z = std::numeric_limits<double>::infinity();
  double w = 0.0;
  for (const auto& p : problem.points()) {
    const double current = p.i_peak_A > 0.0 ? p.i_peak_A : std::abs(p.p_in_W) / (1.5 * p.v_peak_V);
    if (current > 0.0) Z = std::min(Z, p.v_peak_V / current);
    w = std::max(w, 2.0 * kPi * p.f_Hz);
  }
  low_ = {1e-4 * Z, 1e-4 * Z, 2e-3 * Z / w, 0.1 * Z / w};
  high_ = {Z, 2.0 * Z, 2.0 * Z / w, 200.0 * Z / w};
}

double PointsSearch::minimum(Theta& theta) {
  fixed_ = as_array(theta);
  nlopt::opt search(nlopt::LD_SLSQP, static_cast<unsigned>(free_.size()));
  std::vector<double> low, high, x;
  for (const int m : free_) {
    low.push_back(std::log(low_[index(m)]));
    high.push_back(std::log(high_[index(m)]));
    x.push_back(std::clamp(std::log(fixed_[index(m)]), low.back(), high.back()));
  }
  search.set_lower_bounds(low);
  search.set_upper_bounds(high);
  search.set_ftol_rel(1e-9);
  search.set_maxeval(kMostEvaluations);
  search.set_min_objective(&PointsSearch::objective, this);
  scale_ = problem_.linearize(at(x)).error;
  if (!std::isfinite(scale_)) return std::numeric_limits<double>::infinity();
  scale_ = std::max(scale_, 1e-300);
  double error = 0.0;
  try {
    search.optimize(x, error);
  } catch (const nlopt::roundoff_limited&) {
    // The best point so far is in x.
  } catch (const std::exception&) {
    return std::numeric_limits<double>::infinity();
  }
  theta = at(x);
  error = problem_.linearize(theta).error;
  return std::isfinite(error) ? error : std::numeric_limits<double>::infinity();
}

bool PointsSearch::polish(Theta& theta) const {
  double damping = 1e-6;
  PointsLinearization here = problem_.linearize(theta);
  for (int step = 0; step < kMostPolishSteps; ++step) {
    const Eigen::VectorXd move = damped_step(theta, here, damping);
    const double part = std::sqrt(std::max(0.0, -move.dot(log_gradient(theta, here))));
    const double sigma = std::max(
        1.0, std::sqrt(here.error));  // chi^2 far above its degrees of freedom widens the intervals too
    if (part < kSettled * sigma) return true;
    const Theta tried = moved(theta, move);
    const PointsLinearization there = problem_.linearize(tried);
    if (there.error <= here.error) {
      theta = tried;
      here = there;
      damping = std::max(1e-9, damping * 0.2);
    } else {
      damping *= 10.0;
      if (damping > 1e8) return part < 1e-2 * sigma;
    }
  }
  return false;
}

std::array<bool, 4> PointsSearch::on_bound(const Theta& theta) const {
  std::array<bool, 4> on{};
  const Values v = as_array(theta);
  for (const int m : free_) {
    const std::size_t k = index(m);
    on[k] = std::log(v[k] / low_[k]) < kOnBound || std::log(high_[k] / v[k]) < kOnBound;
  }
  return on;
}

Theta PointsSearch::at(const std::vector<double>& x) const {
  Values v = fixed_;
  for (std::size_t k = 0; k < free_.size(); ++k) v[index(free_[k])] = std::exp(x[k]);
  return from_array(v);
}

double PointsSearch::objective(const std::vector<double>& x, std::vector<double>& gradient, void* self) {
  const auto* search = static_cast<const PointsSearch*>(self);
  const Theta theta = search->at(x);
  const PointsLinearization here = search->problem_.linearize(theta);
  if (!gradient.empty()) {
    const Eigen::VectorXd slope = 2.0 * search->log_gradient(theta, here) / search->scale_;
    std::copy(slope.begin(), slope.end(), gradient.begin());
  }
  return here.error / search->scale_;
}

// Zero for a parameter that lies on its bound and is pushed outwards.
Eigen::VectorXd PointsSearch::log_gradient(const Theta& theta, const PointsLinearization& here) const {
  const Values v = as_array(theta);
  Eigen::VectorXd g(row(free_.size()));
  for (std::size_t k = 0; k < free_.size(); ++k) {
    const std::size_t m = index(free_[k]);
    const double slope = here.gradient[free_[k]] * v[m];
    const bool outwards = (v[m] <= low_[m] && slope > 0.0) || (v[m] >= high_[m] && slope < 0.0);
    g[row(k)] = outwards ? 0.0 : slope;
  }
  return g;
}

Eigen::VectorXd PointsSearch::damped_step(const Theta& theta, const PointsLinearization& here,
                                          double damping) const {
  const Values v = as_array(theta);
  const Eigen::VectorXd gradient = log_gradient(theta, here);
  const Eigen::Index n = gradient.size();
  Eigen::MatrixXd normal(n, n);
  for (Eigen::Index a = 0; a < n; ++a) {
    for (Eigen::Index b = 0; b < n; ++b) {
      const int i = free_[static_cast<std::size_t>(a)];
      const int j = free_[static_cast<std::size_t>(b)];
      const bool held = a != b && (gradient[a] == 0.0 || gradient[b] == 0.0);
      normal(a, b) = held ? 0.0 : here.normal(i, j) * v[index(i)] * v[index(j)];
    }
  }
  normal.diagonal() *= 1.0 + damping;
  const Eigen::VectorXd move = -normal.ldlt().solve(gradient);
  return move.cwiseMax(-1.0).cwiseMin(1.0);
}

Theta PointsSearch::moved(const Theta& theta, const Eigen::VectorXd& move) const {
  Values v = as_array(theta);
  for (std::size_t k = 0; k < free_.size(); ++k) {
    const std::size_t m = index(free_[k]);
    v[m] = std::clamp(v[m] * std::exp(move[row(k)]), low_[m], high_[m]);
  }
  return from_array(v);
}

}  // namespace imrig::est
