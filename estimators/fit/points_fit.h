#pragma once
// The phasor circuit fitted to a table of steady operating points: R_s, R_r, L_l, L_m from current and input
// power at the measured voltage, frequency and speed. The speed is uncertain too (a small error of it is a
// large error of the slip), so each point's true speed is an unknown that its measured value pulls at (errors
// in variables):
//   minimize sum_k (I_hat - I)^2/s_I^2 + (P_hat - P)^2/s_P^2 + d_k^2/s_w^2, with I_hat, P_hat at w_k + d_k.
// NLopt's SLSQP with exact derivatives over ln(theta) from several starts inside wide bounds, then
// Gauss-Newton steps. What the base circuit lacks (iron, friction, stray loss) is not hidden: chi^2 per
// degree of freedom and the misfit of each point are part of the result, and the intervals grow with chi^2.
// Torque and shaft power are fitted only in rows without input power, since they hold friction.

#include <array>
#include <string>
#include <vector>

#include "estimators/model/steady_state.h"
#include "rig/data/record.h"

namespace imrig::est {

struct PointsOptions {
  int pole_pairs = 0;
  Noise noise;                                    // NaN: defaults of points_noise
  double R_s = kMissing;                          // given and kept; NaN: fitted
  std::vector<MachineParameters<double>> starts;  // besides the ones from the table itself
};

struct PointMisfit {
  SteadyPoint predicted;           // at the fitted speed
  double speed_shift_rad_s = 0.0;  // fitted minus measured, mechanical
  double current = 0.0;            // (predicted - measured) / measured; NaN where not measured
  double power = 0.0;              // (predicted - measured) / largest measured power
  double shaft_W = kMissing;  // predicted air-gap power minus measured shaft power: what the circuit lacks
};

struct PointsFit {
  std::string failure;  // empty when it converged
  MachineParameters<double> theta;
  std::array<double, 4> sigma{};    // of R_s, R_r, L_l, L_m; already grown with chi^2; 0 for a given R_s
  std::array<double, 4> per_R_s{};  // d theta / d R_s where R_s was given
  std::array<bool, 4> on_bound{};
  double chi2_per_dof = kMissing;
  double nrmse = kMissing;          // current and power together, relative
  std::vector<PointMisfit> misfit;  // one per usable point
  std::vector<std::size_t> used;    // rows of the table
  std::vector<std::string> notes;
};

// The noise of a table: what is declared, else 0.5 % of the current, 1 % of the largest power and 0.5 rpm.
Noise points_noise(const std::vector<SteadyPoint>& points, const Noise& declared);

// Throws Error when the speeds contradict the frequency and the number of pole pairs.
PointsFit fit_points(const std::vector<SteadyPoint>& points, const PointsOptions& options);

}  // namespace imrig::est
