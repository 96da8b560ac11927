#pragma once
// Where the residual of a transient fit comes from, and what follows for the estimate.
//   r = F n_i - H n_v - H_w n_w
// White noise of the current channels n_i through the matched filter F, of the voltage channels n_v through
// the machine H, of the speed n_w through the machine's rotor H_w. F and H are known from the fit, so sigma_i
// and sigma_v follow from two moments of the residual: its mean square and that of its first difference. (A
// machine that does not quite fit shows as voltage noise, and widens the intervals.) Then, with A = (J' J)^-1
// J':
//   covariance of the estimate = A (s_i^2 F F* + s_v^2 H H* + s_w^2 H_w H_w*) A'
//   bias of the estimate = -(J' J)^-1 b, b = E[J' r] = s_v^2 (1/2) d/d theta sum |H|^2: noise on the input
//   pulls the fit toward machines that
// pass less of it (errors in variables); it is subtracted by the caller.
// H is taken at the record's own speed; H* (adjoint) by running the machine over the reversed conjugate.

#include <Eigen/Core>

#include "estimators/fit/record_problem.h"
#include "rig/data/record.h"

namespace imrig::est {

struct TransientNoise {
  double current_A = 0.0;  // one sigma of each component of a sample, before the matched filter
  double voltage_V = 0.0;
  double current_gain =
      1.0;  // variance of the residual per variance of the current channels (matched filter)
  double voltage_gain = 0.0;  // A^2/V^2: likewise of the voltage channels (machine)
  Eigen::Matrix4d covariance =
      Eigen::Matrix4d::Zero();  // of R_s, R_r, L_l, L_m; the row of R_s is zero where it is not free
  Eigen::Vector4d bias = Eigen::Vector4d::Zero();     // estimate minus truth, expected
  Eigen::Vector4d per_R_s = Eigen::Vector4d::Zero();  // d theta / d R_s where R_s is not free
};

// here, columns: the problem's at theta. declared: its speed noise enters; its voltage noise, where given,
// caps what counts for the bias.
TransientNoise transient_noise(const RecordProblem& problem, const MachineParameters<double>& theta,
                               bool fit_R_s, const Linearization& here, const RecordColumns& columns,
                               const Noise& declared);

}  // namespace imrig::est
