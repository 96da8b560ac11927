#pragma once
// The constrained minimum of one record's error over ln(theta), inside bounds relative to a nominal circuit.
// NLopt's SLSQP works in coordinates y = U ln(theta), U' U the Gauss-Newton Hessian at the start, so that its
// first quasi-Newton matrix, the identity, is already right; the bounds become linear constraints.
// Gauss-Newton steps finish, first on the thinned record, then on the whole one.

#include <array>
#include <vector>

#include "estimators/fit/record_problem.h"

namespace imrig::est {

inline constexpr double kBoundLow = 0.1;
inline constexpr double kBoundHigh = 3.0;

class TransientSearch {
 public:
  // quick: for NLopt, without the nuisance unknowns.
  TransientSearch(const RecordProblem& quick, const MachineParameters<double>& nominal, bool fit_R_s);

  // NLopt's part, from theta. False when the optimizer fails outright.
  bool constrained_minimum(MachineParameters<double>& theta);

  // Gauss-Newton over what lies inside its bounds, until a step is shorter than `settled` standard deviations
  // (of white errors: what coloured ones make of it is longer); that one is taken still. False when it does
  // not settle. here, columns: the problem at the point before it.
  bool polish(const RecordProblem& problem, double settled, MachineParameters<double>& theta,
              Linearization& here, RecordColumns* columns);

  std::array<bool, kCircuit> on_bound(const MachineParameters<double>& theta) const;
  int evaluations() const { return evaluations_; }

 private:
  struct Step {
    MachineParameters<double> theta;
    double part = 0.0;  // length in standard deviations
  };
  static double objective(unsigned n, const double* y, double* gradient, void* self);
  static void limits(unsigned m, double* result, unsigned n, const double* y, double* gradient, void* self);
  MachineParameters<double> at(const double* y) const;
  Linearization linearize(const RecordProblem& problem, const MachineParameters<double>& theta,
                          RecordColumns* columns = nullptr);
  Eigen::MatrixXd reduced_hessian(const MachineParameters<double>& theta, const Linearization& here) const;
  double wander(
      const MachineParameters<double>& theta) const;  // sum of ln(theta/nominal)^2 over what is free
  Step step_from(const RecordProblem& problem, const MachineParameters<double>& theta,
                 const Linearization& here) const;

  const RecordProblem& quick_;
  std::array<double, kCircuit> nominal_;
  std::vector<int> free_;
  std::array<double, kCircuit> origin_{};  // theta at y = 0
  Eigen::MatrixXd to_log_;                 // inverse of U
  double weight_ = 0.0;                    // A^2: w of the search by NLopt
  double scale_ = 1.0;  // A^2: a typical error, so that the objective is of order one near its minimum
  int evaluations_ = 0;
};

}  // namespace imrig::est
