#pragma once
// The bars of the cage as one more branch, from locked-like sweeps: R_2 in parallel to L_2, in series with R_1, carried by
// a state of its own, so that each part of a transient sees the resistance of its own slip frequency. At a steady w_s
//   R_r(w_s) = R_1 + R_2 u^2/(1 + u^2),   L_l(w_s) = L_0 + L_2/(1 + u^2),   u = w_s L_2/R_2
// with one R_1 and one L_0 a sweep: sweeps differ in temperature and in current.
// The paper's straight line R_1 + k_6 w_s is the tangent of this where the sweep lies; below it a bar's curve is flat, and a
// start, whose flux has parts at several slip frequencies at once, follows no function of one of them.
// R_2 goes with the cage's temperature as R_1 does, L_2 does not. Assumes R_r well below w L_m.
// Source: the double cage, e.g. Alger 1970, Induction Machines, chapter 8.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "estimators/model/model.h"

namespace imrig::est {

struct LockedPoint;

struct DeepBar {
  std::string failure = "no locked-like sweep";
  Parameter R_2;                          // ohm, at the first sweep's temperature
  Parameter L_2;                          // H
  double R_1_ohm = kMissing;              // of the first sweep: R_2 scales with R_1
  double misfit = kMissing;               // of R_r, rms, relative
  struct Sweep {
    Parameter R_1;              // ohm, where w_s goes to zero
    double L_l_H = kMissing;    // L_0 + L_2: what small slips see, at the sweep's current
    double L_l_sigma_H = kMissing;  // without the gains
  };
  std::vector<Sweep> sweeps;
  bool known() const { return failure.empty(); }
  double R_2_at(double R_1) const { return known() ? R_2.value * R_1 / R_1_ohm : 0.0; }
};

// The points of all sweeps. columns: of the straight line's fit, one intercept a sweep, drifts, and w_s last, which the bar's
// curve replaces. gain_sigma: relative.
DeepBar fit_deep_bar(const Eigen::MatrixXd& columns, const std::vector<const LockedPoint*>& points, std::size_t sweeps,
                     double gain_sigma);

}  // namespace imrig::est
