#include "estimators/diagnose/missing/record_values.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "estimators/fit/student_t.h"
#include "estimators/model/effects/registry.h"

namespace imrig::est {

namespace {

// A record tells no extreme that knows its value less well than so many times the usual sigma, unless that is
// little beside what others differ by.
constexpr double kKnown = 3.0, kLittle = 0.1;

Parameter parameter(double value, double sigma, const char* unit) {
  return {value, value - kNormal975 * sigma, value + kNormal975 * sigma, unit, "refit"};
}

double median(std::vector<double> x) {
  const auto middle = x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2);
  std::nth_element(x.begin(), middle, x.end());
  return *middle;
}

}  // namespace

RecordValues record_values(const GlobalProblem& problem, const Trial& trial, const GlobalTerms& terms,
                           const std::vector<std::size_t>& which, std::size_t local) {
  const Freedom free = trial.model.freedom();
  const auto s = static_cast<Eigen::Index>(free.shared.size());
  RecordValues out;
  for (std::size_t k = 0; k < which.size(); ++k) {
    const auto locals = problem.locals_of(which[k], free.local);
    const auto at = std::find(locals.begin(), locals.end(), local) - locals.begin();
    const auto l = static_cast<Eigen::Index>(locals.size());
    if (at == l) {
      out.y.push_back(kMissing), out.sigma.push_back(kMissing);
      continue;
    }
    const Eigen::MatrixXd inverse =
        terms.records[k].normal.block(s, s, l, l).ldlt().solve(Eigen::MatrixXd::Identity(l, l));
    out.y.push_back(trial.model.at.local[which[k]][local]);
    out.sigma.push_back(std::sqrt(std::max(0.0, inverse(at, at))));
  }
  return out;
}

std::map<std::string, Parameter> estimates_by_record(const GlobalProblem& problem, const Trial& trial,
                                                     const Candidate& candidate) {
  const auto which = problem.fitted();
  const GlobalTerms terms =
      problem.evaluate(trial.model.at, trial.model.freedom(), which, trial.model.live_priors());
  const std::size_t first = kLocalPlace[candidate.effect], n = kEffectInfos[candidate.effect].local.size();
  std::vector<RecordValues> values;
  for (std::size_t e = first; e < first + n; ++e)
    values.push_back(record_values(problem, trial, terms, which, e));
  std::vector<double> size, sigma;
  for (std::size_t k = 0; k < which.size(); ++k) {
    double square = 0.0, variance = 0.0;
    for (const RecordValues& v : values)
      square += v.y[k] * v.y[k], variance += v.sigma[k] * v.sigma[k] / static_cast<double>(n);
    if (!std::isfinite(square) || !std::isfinite(variance)) continue;
    size.push_back(n == 1 ? values.front().y[k] : std::sqrt(square));
    sigma.push_back(std::sqrt(variance));
  }
  if (size.empty()) return {};
  const EffectParameter& p = kEffectInfos[candidate.effect].local.front();
  std::map<std::string, Parameter> out;
  if (n > 1) {
    double weights = 0.0, sum = 0.0, spread = 0.0;
    const auto weight = [](double s) { return 1.0 / std::max(s * s, 1e-18); };
    for (std::size_t k = 0; k < size.size(); ++k)
      weights += weight(sigma[k]), sum += weight(sigma[k]) * size[k];
    const double mean = sum / weights;
    for (std::size_t k = 0; k < size.size(); ++k) spread += weight(sigma[k]) * std::pow(size[k] - mean, 2);
    const double scatter = std::max(1.0, spread / std::max(1.0, static_cast<double>(size.size()) - 1.0));
    out["beta"] = parameter(mean, std::sqrt(scatter / weights), p.unit);
    return out;
  }
  std::size_t lowest = size.size(), highest = size.size();
  const auto look = [&](double least_known) {
    for (std::size_t k = 0; k < size.size(); ++k) {
      if (sigma[k] > least_known) continue;
      if (lowest == size.size() || size[k] < size[lowest]) lowest = k;
      if (highest == size.size() || size[k] > size[highest]) highest = k;
    }
  };
  look(kKnown * median(sigma));
  look(kLittle * (size[highest] - size[lowest]));
  out[std::string(p.name) + "_lowest"] = parameter(size[lowest], sigma[lowest], p.unit);
  out[std::string(p.name) + "_highest"] = parameter(size[highest], sigma[highest], p.unit);
  return out;
}

}  // namespace imrig::est
