#include "estimators/diagnose/next/visibility.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "estimators/diagnose/missing/score_test.h"
#include "estimators/model/effects/registry.h"

namespace imrig::est {

namespace {

constexpr std::size_t kScan = 1;  // usual shapes

struct Amplitude {
  std::size_t effect = 0, entry = 0;
};

// The plainest form's amplitudes that fit into one evaluation.
std::vector<Amplitude> amplitudes_of(const std::vector<std::size_t>& effects, const Freedom& free) {
  const std::size_t room = kMostLanes - free.shared.size() - free.local.size();
  std::vector<Amplitude> out;
  for (const std::size_t effect : effects) {
    for (const std::size_t e : shared_entries({effect, 0})) {
      const bool taken = std::find(free.shared.begin(), free.shared.end(), e) != free.shared.end();
      if (shared_parameter(e).role == Role::kAmplitude && !taken && out.size() < room)
        out.push_back({effect, e});
    }
  }
  return out;
}

// d of each amplitude, those below it projected out.
std::vector<double> visible(const Eigen::MatrixXd& normal, std::size_t free,
                            const std::vector<double>& sizes) {
  const auto f = static_cast<Eigen::Index>(free), n = normal.rows();
  const Eigen::VectorXd scale = normal.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  Eigen::MatrixXd scaled = scale.asDiagonal() * normal * scale.asDiagonal();
  scaled.diagonal().array() += 1e-11;
  if (n == f) return {};
  const Eigen::MatrixXd cross = scaled.topRightCorner(f, n - f);
  const Eigen::MatrixXd taken = cross.transpose() * scaled.topLeftCorner(f, f).ldlt().solve(cross);
  std::vector<double> out;
  for (std::size_t k = 0; k < sizes.size(); ++k) {
    const auto m = static_cast<Eigen::Index>(k);
    const double left = std::max(0.0, scaled(f + m, f + m) - taken(m, m)) * normal(f + m, f + m);
    out.push_back(0.5 * sizes[k] * std::sqrt(left));
  }
  return out;
}

}  // namespace

Visibility visibility(const GlobalProblem& problem, const WorkingModel& base,
                      const std::vector<std::size_t>& effects, const std::vector<Experiment>& menu) {
  std::vector<PlannedRecord> records;
  for (const Experiment& e : menu) records.insert(records.end(), e.records.begin(), e.records.end());
  GlobalProblem more = imagined(problem, base, records);
  GlobalPoint at = settled_in(more, base, records);
  more.pretend(at);
  at.shared = scanned(base, kScan);
  Freedom free = base.freedom();
  const std::size_t fixed = free.shared.size();
  const std::vector<Amplitude> amplitudes = amplitudes_of(effects, free);
  std::vector<double> sizes;
  for (const Amplitude& a : amplitudes) {
    free.shared.push_back(a.entry);
    sizes.push_back(material_size(problem, base.at.shared, a.entry));
  }
  std::vector<std::size_t> which = problem.fitted();
  const std::size_t own = which.size();
  for (std::size_t k = 0; k < records.size(); ++k) which.push_back(problem.entries().size() + k);
  const GlobalTerms terms = more.evaluate(at, free, which, base.priors);

  // Of an effect with several amplitudes the one that is seen best.
  Visibility out;
  const auto by_effect = [&](const std::vector<double>& d) {
    std::vector<double> best(out.effects.size(), 0.0);
    for (std::size_t k = 0; k < amplitudes.size(); ++k) {
      const auto place =
          std::find(out.effects.begin(), out.effects.end(), amplitudes[k].effect) - out.effects.begin();
      double& here = best[static_cast<std::size_t>(place)];
      here = std::max(here, d[k]);
    }
    return best;
  };
  for (const Amplitude& a : amplitudes) {
    if (std::find(out.effects.begin(), out.effects.end(), a.effect) == out.effects.end())
      out.effects.push_back(a.effect);
  }
  Eigen::MatrixXd now = terms.normal;
  for (std::size_t k = own; k < which.size(); ++k) now -= terms.normals[k];
  out.now = by_effect(visible(now, fixed, sizes));
  std::size_t k = own;
  for (const Experiment& e : menu) {
    Eigen::MatrixXd normal = now;
    for (std::size_t n = 0; n < e.records.size(); ++n) normal += terms.normals[k++];
    out.with.push_back(by_effect(visible(normal, fixed, sizes)));
  }
  return out;
}

}  // namespace imrig::est
