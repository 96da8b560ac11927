#include "estimators/fit/global/settle.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "estimators/model/effects/registry.h"

namespace imrig::est {

namespace {

constexpr int kMostRounds = 25;

void add_priors(const std::vector<std::size_t>& free, const LocalVector<double>& x, RecordTerms& terms) {
  for (std::size_t m = 0; m < free.size(); ++m) {
    const double sigma = local_prior_sigma(free[m]);
    if (!std::isfinite(sigma)) continue;
    const auto d = static_cast<Eigen::Index>(m);
    const double off = x[free[m]] / sigma;
    terms.chi2 += off * off;
    terms.normal(d, d) += 1.0 / (sigma * sigma);
    terms.gradient[d] += off / sigma;
  }
}

LocalVector<double> moved(const LocalVector<double>& from, const std::vector<std::size_t>& free,
                          const RecordTerms& terms, double damping) {
  Eigen::MatrixXd D = terms.normal;
  D.diagonal() *= 1.0 + damping + 1e-12;
  D.diagonal().array() += 1e-12;
  const Eigen::VectorXd step = D.ldlt().solve(terms.gradient);
  LocalVector<double> to = from;
  for (std::size_t m = 0; m < free.size(); ++m) {
    to[free[m]] -= step[static_cast<Eigen::Index>(m)];
    if (free[m] < kStates) continue;
    const EffectParameter& p = local_parameter(free[m]);
    to[free[m]] = std::clamp(to[free[m]], p.low, p.high);
  }
  return to;
}

}  // namespace

double local_prior_sigma(std::size_t entry) {
  return entry < kStates ? std::numeric_limits<double>::infinity() : 0.2;
}

void settle_record(const DrivenRecord& record, const Whitener& whitener, int steps,
                   const SharedVector<double>& shared, const std::vector<std::size_t>& free,
                   LocalVector<double>& local) {
  LocalVector<double> x = local;
  RecordTerms best;
  best.chi2 = std::numeric_limits<double>::infinity();
  double damping = 0.0;
  for (int round = 0; round < kMostRounds; ++round) {
    RecordTerms terms = record_terms(record, whitener, steps, shared, x, {{}, free});
    add_priors(free, x, terms);
    const bool better = std::isfinite(terms.chi2) && terms.chi2 < best.chi2;
    const bool settled = better && best.chi2 - terms.chi2 < 1e-6 * terms.chi2 + 1e-3;
    if (better) {
      best = std::move(terms);
      local = x;
      damping = damping < 1e-5 ? 0.0 : 0.1 * damping;
    } else {
      if (best.gradient.size() == 0 || damping > 1e6) return;
      damping = damping == 0.0 ? 1e-3 : 10.0 * damping;
    }
    if (settled) return;
    x = moved(local, free, best, damping);
  }
}

}  // namespace imrig::est
