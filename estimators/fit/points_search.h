#pragma once
// The constrained minimum of a point table's chi^2 over ln(theta): NLopt's SLSQP with exact derivatives from
// one start, then damped Gauss-Newton (Levenberg-Marquardt) steps. Bounds are wide: what any induction
// machine has, in units of the table's smallest impedance.

#include <array>
#include <vector>

#include "estimators/fit/points_problem.h"

namespace imrig::est {

class PointsSearch {
 public:
  // fit_R_s = false keeps R_s as it comes.
  PointsSearch(const PointsProblem& problem, bool fit_R_s);

  // From one start (moved inside the bounds) to NLopt's minimum; chi^2 there, infinity when the optimizer
  // fails.
  double minimum(MachineParameters<double>& theta);

  // Until a step is a small part of a standard deviation. False when it does not settle.
  bool polish(MachineParameters<double>& theta) const;

  std::array<bool, 4> on_bound(const MachineParameters<double>& theta) const;

 private:
  static double objective(const std::vector<double>& x, std::vector<double>& gradient, void* self);
  MachineParameters<double> at(const std::vector<double>& x) const;
  Eigen::VectorXd log_gradient(const MachineParameters<double>& theta, const PointsLinearization& here) const;
  Eigen::VectorXd damped_step(const MachineParameters<double>& theta, const PointsLinearization& here,
                              double damping) const;
  MachineParameters<double> moved(const MachineParameters<double>& theta, const Eigen::VectorXd& move) const;

  const PointsProblem& problem_;
  std::vector<int> free_;
  std::array<double, 4> low_{}, high_{};
  std::array<double, 4> fixed_{};
  double scale_ = 1.0;
};

}  // namespace imrig::est
