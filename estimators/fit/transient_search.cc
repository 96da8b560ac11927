#include "estimators/fit/transient_search.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <nlopt.hpp>

#include "estimators/fit/inverse.h"

namespace imrig::est {

namespace {

constexpr int kMostEvaluations = 80;
constexpr int kMostPolishSteps = 12;
constexpr double kOnBound = 1e-4;  // in ln(theta)
constexpr double kEdge = 1e-9;     // the same, for NLopt's constraints
constexpr double kRidge =
    1e-6;  // of the Hessian's trace: keeps the coordinates finite where the record is blind

using Theta = MachineParameters<double>;

std::array<double, kCircuit> as_array(const Theta& p) { return {p.R_s, p.R_r, p.L_l, p.L_m}; }
Theta from_array(const std::array<double, kCircuit>& a) { return {a[0], a[1], a[2], a[3]}; }
std::size_t index(int m) { return static_cast<std::size_t>(m); }

Theta between(const Theta& a, const Theta& b, double share) {
  return {a.R_s + share * (b.R_s - a.R_s), a.R_r + share * (b.R_r - a.R_r), a.L_l + share * (b.L_l - a.L_l),
          a.L_m + share * (b.L_m - a.L_m)};
}

}  // namespace

TransientSearch::TransientSearch(const RecordProblem& quick, const Theta& nominal, bool fit_R_s)
    : quick_(quick), nominal_(as_array(nominal)) {
  for (int m = fit_R_s ? 0 : 1; m < kCircuit; ++m) free_.push_back(m);
}

Linearization TransientSearch::linearize(const RecordProblem& problem, const Theta& theta,
                                         RecordColumns* columns) {
  ++evaluations_;
  return problem.linearize(theta, columns);
}

Theta TransientSearch::at(const double* y) const {
  const Eigen::Map<const Eigen::VectorXd> coordinates(y, to_log_.cols());
  const Eigen::VectorXd logs = to_log_ * coordinates;
  auto values = origin_;
  for (std::size_t k = 0; k < free_.size(); ++k) {
    values[index(free_[k])] *= std::exp(std::clamp(logs[static_cast<Eigen::Index>(k)], -5.0, 5.0));
  }
  return from_array(values);
}

// Of the error / 2 in ln(theta), what is linear eliminated.
Eigen::MatrixXd TransientSearch::reduced_hessian(const Theta& theta, const Linearization& here) const {
  const auto values = as_array(theta);
  const auto n = static_cast<Eigen::Index>(free_.size());
  const auto& linear = quick_.linear_unknowns();
  const Normal behind = inverse_over(here.normal, linear);
  Eigen::MatrixXd across = Eigen::MatrixXd::Zero(kUnknowns, n);
  Eigen::MatrixXd own(n, n);
  for (Eigen::Index b = 0; b < n; ++b) {
    const int m = free_[static_cast<std::size_t>(b)];
    for (const int k : linear) across(k, b) = here.normal(k, m) * values[index(m)];
    for (Eigen::Index a = 0; a < n; ++a) {
      const int l = free_[static_cast<std::size_t>(a)];
      own(a, b) = here.normal(l, m) * values[index(l)] * values[index(m)];
    }
  }
  const double weight = here.error / static_cast<double>(2 * quick_.judged());
  return own - across.transpose() * behind * across + weight * Eigen::MatrixXd::Identity(n, n);
}

bool TransientSearch::constrained_minimum(Theta& theta) {
  auto values = as_array(theta);
  for (const int m : free_) {
    values[index(m)] =
        std::clamp(values[index(m)], nominal_[index(m)] * kBoundLow, nominal_[index(m)] * kBoundHigh);
  }
  origin_ = values;
  const Linearization here = linearize(quick_, from_array(values));
  if (!std::isfinite(here.error) || !(here.error > 0.0)) return false;
  scale_ = here.error;
  weight_ = here.error / static_cast<double>(2 * quick_.judged());
  const auto n = static_cast<Eigen::Index>(free_.size());
  Eigen::MatrixXd hessian = reduced_hessian(from_array(values), here) * (2.0 / scale_);
  hessian.diagonal().array() += kRidge * hessian.trace();
  const Eigen::LLT<Eigen::MatrixXd> factor(hessian);
  if (factor.info() != Eigen::Success) return false;
  to_log_ = factor.matrixU().solve(Eigen::MatrixXd::Identity(n, n));

  nlopt::opt search(nlopt::LD_SLSQP, static_cast<unsigned>(n));
  search.set_min_objective(&TransientSearch::objective, this);
  search.add_inequality_mconstraint(&TransientSearch::limits, this,
                                    std::vector<double>(static_cast<std::size_t>(2 * n), kEdge));
  search.set_ftol_rel(1e-4);
  search.set_maxeval(kMostEvaluations);
  std::vector<double> y(static_cast<std::size_t>(n), 0.0);
  double least = 0.0;
  try {
    search.optimize(y, least);
  } catch (const nlopt::roundoff_limited&) {
    // The best point so far is in y.
  } catch (const std::exception&) {
    return false;
  }
  values = as_array(at(y.data()));
  for (const int m : free_) {
    values[index(m)] =
        std::clamp(values[index(m)], nominal_[index(m)] * kBoundLow, nominal_[index(m)] * kBoundHigh);
  }
  theta = from_array(values);
  return std::isfinite(least);
}

double TransientSearch::objective(unsigned n, const double* y, double* gradient, void* self) {
  auto* search = static_cast<TransientSearch*>(self);
  const Theta theta = search->at(y);
  const Linearization here = search->linearize(search->quick_, theta);
  if (gradient != nullptr) {
    const auto values = as_array(theta);
    Eigen::VectorXd slope(static_cast<Eigen::Index>(n));
    for (unsigned k = 0; k < n; ++k) {
      const std::size_t m = index(search->free_[k]);
      slope[static_cast<Eigen::Index>(k)] = 2.0 * here.gradient[search->free_[k]] * values[m] +
                                            2.0 * search->weight_ * std::log(values[m] / search->nominal_[m]);
    }
    const Eigen::VectorXd turned = search->to_log_.transpose() * slope / search->scale_;
    std::copy(turned.begin(), turned.end(), gradient);
  }
  return (here.error + search->weight_ * search->wander(theta)) / search->scale_;
}

// Each free parameter above its lower and below its upper bound: result <= 0.
void TransientSearch::limits(unsigned, double* result, unsigned n, const double* y, double* gradient,
                             void* self) {
  const auto* search = static_cast<const TransientSearch*>(self);
  const Eigen::Map<const Eigen::VectorXd> coordinates(y, static_cast<Eigen::Index>(n));
  const Eigen::VectorXd logs = search->to_log_ * coordinates;
  for (unsigned k = 0; k < n; ++k) {
    const std::size_t m = index(search->free_[k]);
    const double x = logs[static_cast<Eigen::Index>(k)] + std::log(search->origin_[m] / search->nominal_[m]);
    result[k] = std::log(kBoundLow) - x;
    result[n + k] = x - std::log(kBoundHigh);
    if (gradient == nullptr) continue;
    for (unsigned j = 0; j < n; ++j) {
      const double slope = search->to_log_(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(j));
      gradient[k * n + j] = -slope;
      gradient[(n + k) * n + j] = slope;
    }
  }
}

double TransientSearch::wander(const Theta& theta) const {
  const auto values = as_array(theta);
  double sum = 0.0;
  for (const int m : free_) sum += std::pow(std::log(values[index(m)] / nominal_[index(m)]), 2);
  return sum;
}

TransientSearch::Step TransientSearch::step_from(const RecordProblem& problem, const Theta& theta,
                                                 const Linearization& here) const {
  const auto bound = on_bound(theta);
  std::vector<int> moving;
  for (const int m : free_) {
    if (!bound[index(m)]) moving.push_back(m);
  }
  moving.insert(moving.end(), problem.linear_unknowns().begin(), problem.linear_unknowns().end());
  const double variance = here.error / static_cast<double>(2 * problem.judged());
  Normal normal = here.normal;
  Unknowns gradient = here.gradient;
  const auto at = as_array(theta);
  for (const int m : free_) {
    normal(m, m) += variance / (at[index(m)] * at[index(m)]);
    gradient[m] += variance * std::log(at[index(m)] / nominal_[index(m)]) / at[index(m)];
  }
  const Unknowns move = -(inverse_over(normal, moving) * gradient);
  Step step;
  step.part = std::sqrt(std::max(0.0, -move.dot(gradient)) / std::max(variance, 1e-300));
  auto values = as_array(theta);
  for (const int m : free_) {
    const double old = values[index(m)];
    const double wanted = old + std::clamp(move[m], -0.5 * old, old);
    values[index(m)] = std::clamp(wanted, nominal_[index(m)] * kBoundLow, nominal_[index(m)] * kBoundHigh);
  }
  step.theta = from_array(values);
  return step;
}

bool TransientSearch::polish(const RecordProblem& problem, double settled, Theta& theta, Linearization& here,
                             RecordColumns* columns) {
  here = linearize(problem, theta, columns);
  for (int count = 0; count < kMostPolishSteps; ++count) {
    const Step step = step_from(problem, theta, here);
    if (step.part < settled) {
      theta = step.theta;
      return true;
    }
    const double weight = here.error / static_cast<double>(2 * problem.judged());
    const double before = here.error + weight * wander(theta);
    const auto better = [&](const Theta& at, const Linearization& there) {
      return there.error + weight * wander(at) <= before;
    };
    Theta tried = step.theta;
    Linearization there = linearize(problem, tried, columns);
    for (double length = 0.5; !better(tried, there) && length > 0.01; length *= 0.5) {
      tried = between(theta, step.theta, length);
      there = linearize(problem, tried, columns);
    }
    if (!better(tried, there)) {
      here = linearize(problem, theta, columns);
      return step.part < 0.05;
    }
    theta = tried;
    here = there;
  }
  return false;
}

std::array<bool, kCircuit> TransientSearch::on_bound(const Theta& theta) const {
  std::array<bool, kCircuit> on{};
  const auto values = as_array(theta);
  for (const int m : free_) {
    const double x = std::log(values[index(m)] / nominal_[index(m)]);
    on[index(m)] = x < std::log(kBoundLow) + kOnBound || x > std::log(kBoundHigh) - kOnBound;
  }
  return on;
}

}  // namespace imrig::est
