#include "estimators/diagnose/missing/value_pattern.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <string_view>

#include "estimators/diagnose/missing/record_conditions.h"
#include "estimators/diagnose/missing/record_values.h"
#include "estimators/model/effects/registry.h"

namespace imrig::est {

namespace {

constexpr double kFewest = 8.0;   // records, for a parabola to mean anything
constexpr double kDiffer = 0.25;  // of the values' variance
constexpr double kFollows = 0.7, kFollowsMore = 0.3;  // the same; more than what goes with heat explains

// Share of the values' variance that a parabola over the condition takes away. Weights: a value's own
// variance beside what the values differ by anyway, so that a few well known ones do not decide alone.
double share_explained(const RecordValues& values, const std::vector<double>& condition) {
  std::vector<std::size_t> use;
  for (std::size_t k = 0; k < values.y.size(); ++k) {
    if (std::isfinite(condition[k]) && std::isfinite(values.y[k]) && std::isfinite(values.sigma[k]))
      use.push_back(k);
  }
  const auto n = static_cast<Eigen::Index>(use.size());
  if (static_cast<double>(n) < kFewest) return 0.0;
  Eigen::VectorXd y(n), x(n), own(n);
  for (Eigen::Index m = 0; m < n; ++m) {
    const std::size_t k = use[static_cast<std::size_t>(m)];
    y[m] = values.y[k], x[m] = condition[k], own[m] = std::max(std::pow(values.sigma[k], 2), 1e-12);
  }
  if (x.maxCoeff() == x.minCoeff()) return 0.0;
  const auto variance = [&](const Eigen::VectorXd& w) {
    const double mean = w.dot(y) / w.sum();
    return w.dot((y.array() - mean).square().matrix()) / w.sum();
  };
  const Eigen::VectorXd w = (own.array() + kDiffer * variance(own.cwiseInverse())).inverse().matrix();
  const double whole = variance(w), known = w.sum() * w.sum() / w.squaredNorm();
  if (known < kFewest || whole < own.dot(w) / w.sum()) return 0.0;
  const Eigen::VectorXd u = ((x.array() - x.minCoeff()) / (x.maxCoeff() - x.minCoeff())).matrix();
  Eigen::MatrixXd A(n, 3);
  A << Eigen::VectorXd::Ones(n), u, u.cwiseAbs2();
  const Eigen::VectorXd root = w.cwiseSqrt();
  const Eigen::VectorXd fit = A * (root.asDiagonal() * A).colPivHouseholderQr().solve(root.cwiseProduct(y));
  const double rest = w.dot((y - fit).cwiseAbs2()) / w.sum();
  return 1.0 - rest / whole * (known - 1.0) / (known - 3.0);
}

}  // namespace

std::vector<ValuePattern> value_patterns(const GlobalProblem& problem, const Trial& trial) {
  std::vector<ValuePattern> out;
  const auto which = problem.fitted();
  GlobalTerms terms;
  std::vector<NamedCondition> conditions;
  for (const Candidate& c : trial.model.active) {
    if (!form_of(c).local || kEffectInfos[c.effect].local.size() != 1) continue;
    if (terms.records.empty()) {
      terms = problem.evaluate(trial.model.at, trial.model.freedom(), which, trial.model.live_priors());
      conditions = record_conditions(problem, trial.model.at.shared[0], which);
    }
    const RecordValues values = record_values(problem, trial, terms, which, kLocalPlace[c.effect]);
    ValuePattern p{name_of(c), "", 0.0, 0.0};
    for (const NamedCondition& condition : conditions) {
      const double share = share_explained(values, condition.values);
      const std::string_view name = condition.name;
      if (name == "i_A" || name == "torque_Nm" || name == "stator_C" || name == "order") {
        p.by_heat = std::max(p.by_heat, share);
      } else if (share > p.share) {
        p.share = share, p.condition = name;
      }
    }
    out.push_back(p);
  }
  return out;
}

bool follows(const ValuePattern& pattern) {
  return pattern.share > kFollows && pattern.share > pattern.by_heat + kFollowsMore;
}

}  // namespace imrig::est
