#pragma once
// Efficient score (Lagrange multiplier) test of effects that are not in the model: from one evaluation at the
// current fit, for every candidate
//   lambda = g' M^-1 g,   M = H_cc - H_cf H_ff^-1 H_fc
// with the free parameters f and the records' own unknowns projected out: the drop of chi2 that adding it
// would bring if the problem were linear, and the change of its parameters, -M^-1 g. Shapes that mean nothing
// while the effect is absent are scanned; amplitudes that cannot be negative are kept from it.
// Rao 1948; Silvey 1959. The angle between two candidates' directions tells how far these data can separate
// them: d = sqrt(lambda) sin(theta/2).

#include <vector>

#include "estimators/diagnose/missing/working_model.h"

namespace imrig::est {

struct Score {
  Candidate candidate;
  double lambda = 0.0;
  double dof = 0.0;                     // of lambda, when nothing is missing
  double p_value = 1.0;                 // family-wise (family_wise.h); amplitudes of the motor only
  std::size_t scan = 0;                 // which of the scanned shapes
  std::vector<std::size_t> amplitudes;  // entries of the shared vector
  std::vector<double> change, sigma;    // of the amplitudes, as forecast
};

struct ScoreTest {
  std::vector<Score> scores;  // largest lambda first
  Eigen::MatrixXd cosine;  // |cos| of the angle between the directions of scores a and b; 0 where not known
  double separation(std::size_t a, std::size_t b) const;  // d
};

// candidates: forms to be tested; each must be of an effect that is not active, or a richer amplitude of one.
ScoreTest score_test(const GlobalProblem& problem, const WorkingModel& model,
                     const std::vector<Candidate>& candidates, const std::vector<std::size_t>& which);

// The shared vector with the shapes of every inactive effect at their n-th scanned value.
SharedVector<double> scanned(const WorkingModel& model, std::size_t n);
inline constexpr std::size_t kScans = 3;

}  // namespace imrig::est
