#include "estimators/model/convert.h"

#include <fmt/format.h>

#include <cmath>

#include "rig/base/error.h"

namespace imrig::est {

MachineParameters<double> inverse_gamma_of(const TCircuit& t) {
  const double L_s = t.L_ls + t.L_m;
  const double L_r = t.L_lr + t.L_m;
  const double share = t.L_m / L_r;
  return {t.R_s, t.R_r * share * share, L_s - t.L_m * share, t.L_m * share};
}

MachineParameters<double> inverse_gamma_of(const GammaCircuit& g) {
  // The T circuit without stator leakage.
  return inverse_gamma_of(TCircuit{g.R_s, g.R_r, 0.0, g.L_L, g.L_M});
}

TCircuit t_of(const MachineParameters<double>& p, double L_s_over_L_r) {
  const double L_s = p.L_l + p.L_m;
  const double L_r = L_s / L_s_over_L_r;
  const double L_m = std::sqrt(p.L_m * L_r);
  if (!(L_s_over_L_r > 0.0) || L_m > L_s || L_m > L_r) {
    throw Error("conversion to a T circuit",
                fmt::format("L_s / L_r = {} makes a leakage inductance negative", L_s_over_L_r),
                fmt::format("use a ratio from {:.6g} to {:.6g}", p.L_m / L_s, L_s / p.L_m));
  }
  return {p.R_s, p.R_r * L_r / p.L_m, L_s - L_m, L_r - L_m, L_m};
}

GammaCircuit gamma_of(const MachineParameters<double>& p) {
  const double ratio = (p.L_l + p.L_m) / p.L_m;
  return {p.R_s, p.R_r * ratio * ratio, p.L_l * ratio, p.L_l + p.L_m};
}

MachineParameters<double> delta_phase_of(const MachineParameters<double>& star) {
  return {3.0 * star.R_s, 3.0 * star.R_r, 3.0 * star.L_l, 3.0 * star.L_m};
}

MachineParameters<double> star_of(const MachineParameters<double>& delta_phase) {
  return {delta_phase.R_s / 3.0, delta_phase.R_r / 3.0, delta_phase.L_l / 3.0, delta_phase.L_m / 3.0};
}

}  // namespace imrig::est
