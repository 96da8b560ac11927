#include "estimators/diagnose/missing/neutral_amplitude.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

#include "estimators/fit/student_t.h"
#include "estimators/model/effects/registry.h"

namespace imrig::est {

namespace {

constexpr double kLeastShare = 1e-6;  // of a variance: what is less is rounding

using Rows = std::vector<Eigen::Index>;

// Of unknown a, where those in `given` are known.
double variance_given(const Eigen::MatrixXd& covariance, Eigen::Index a, const Rows& given) {
  if (given.empty()) return covariance(a, a);
  const Eigen::MatrixXd among = covariance(given, given);
  const Eigen::VectorXd scale = among.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::VectorXd with = scale.asDiagonal() * covariance(given, a);
  return covariance(a, a) -
         with.dot((scale.asDiagonal() * among * scale.asDiagonal()).eval().ldlt().solve(with));
}

}  // namespace

bool may_be_neutral(const WorkingModel& model, const Candidate& candidate) {
  const GlobalFit& fit = model.fit;
  if (fit.covariance.size() == 0) return false;  // it failed
  Rows shapes, amplitudes;
  bool any = false;
  for (std::size_t m = 0; m < fit.free.shared.size(); ++m) {
    const std::size_t e = fit.free.shared[m];
    const auto row = static_cast<Eigen::Index>(m);
    if (e < kBase || effect_of_shared(e) != candidate.effect) continue;
    if (shared_parameter(e).role == Role::kAmplitude) any = true;
    if (!(fit.sigma(e) > 0.0)) continue;  // on a bound, or not determined
    (shared_parameter(e).role == Role::kAmplitude ? amplitudes : shapes).push_back(row);
  }
  double most = 0.0;
  for (const Eigen::Index a : amplitudes) {
    const std::size_t e = fit.free.shared[static_cast<std::size_t>(a)];
    const double away = std::abs(model.at.shared[e] - shared_parameter(e).neutral);
    const double variance =
        std::max(variance_given(fit.covariance, a, shapes), kLeastShare * fit.covariance(a, a));
    most = std::max(most, away * away / variance);
  }
  return any && most < kNormal975 * kNormal975;
}

}  // namespace imrig::est
