#include "estimators/diagnose/missing/stability.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "estimators/diagnose/missing/record_conditions.h"
#include "estimators/model/effects/registry.h"

namespace imrig::est {

namespace {

constexpr double kDiffers = 5.0;       // standard errors
constexpr double kDiffersShare = 0.4;  // of the value
constexpr std::size_t kFewest = 4;     // records a half

struct Half {
  Eigen::VectorXd shift;
  Eigen::VectorXd variance;
};

Half half_of(const GlobalTerms& terms, const std::vector<std::size_t>& members) {
  const auto n = terms.normal.rows();
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd g = Eigen::VectorXd::Zero(n);
  for (const std::size_t k : members) {
    H += terms.normals[k];
    g += terms.scores[k];
  }
  const Eigen::VectorXd scale = terms.normal.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  Eigen::MatrixXd scaled = scale.asDiagonal() * H * scale.asDiagonal();
  scaled += 1e-9 * Eigen::MatrixXd::Identity(n, n);
  const Eigen::MatrixXd inverse =
      scale.asDiagonal() * scaled.ldlt().solve(Eigen::MatrixXd::Identity(n, n)) * scale.asDiagonal();
  Half out;
  out.shift = -inverse * g;
  Eigen::MatrixXd spread = Eigen::MatrixXd::Zero(n, n);
  for (const std::size_t k : members) {
    const Eigen::VectorXd own = terms.scores[k] - g / static_cast<double>(members.size());
    spread += own * own.transpose();
  }
  out.variance = inverse.diagonal().cwiseMax((inverse * spread * inverse).diagonal());
  return out;
}

}  // namespace

std::vector<Unstable> unstable(const GlobalProblem& problem, const Trial& trial) {
  std::vector<Unstable> out;
  const auto which = problem.fitted();
  const Freedom free = trial.model.freedom();
  const GlobalTerms terms = problem.evaluate(trial.model.at, free, which, trial.model.live_priors());
  for (const NamedCondition& condition : record_conditions(problem, trial.model.at.shared[0], which)) {
    std::vector<std::size_t> order;
    for (std::size_t k = 0; k < which.size(); ++k) {
      if (std::isfinite(condition.values[k])) order.push_back(k);
    }
    if (order.size() < 2 * kFewest) continue;
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return condition.values[a] < condition.values[b]; });
    if (condition.values[order.front()] == condition.values[order.back()]) continue;
    const auto middle = order.begin() + static_cast<std::ptrdiff_t>(order.size() / 2);
    const Half low = half_of(terms, {order.begin(), middle}), high = half_of(terms, {middle, order.end()});
    for (const Candidate& c : trial.model.active) {
      for (const std::size_t e : shared_entries(c)) {
        if (shared_parameter(e).role != Role::kAmplitude) continue;
        const auto m = std::find(free.shared.begin(), free.shared.end(), e) - free.shared.begin();
        const double value = trial.model.at.shared[e], difference = high.shift[m] - low.shift[m];
        if (std::abs(difference) < kDiffers * std::sqrt(low.variance[m] + high.variance[m])) continue;
        if (std::abs(difference) < kDiffersShare * std::abs(value)) continue;
        out.push_back({shared_name(e), condition.name, value + low.shift[m], value + high.shift[m]});
      }
    }
  }
  return out;
}

}  // namespace imrig::est
