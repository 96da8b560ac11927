#include "estimators/fit/standstill/parametric.h"

#include <cmath>

namespace imrig::est {

RegressionVector regression_of(const TCircuit& t, const StandstillFilters& h) {
  const double L_s = t.L_ls + t.L_m, L_r = t.L_lr + t.L_m;
  const double whole = L_s * L_r - t.L_m * t.L_m;  // sigma L_s L_r
  const double a_1 = (t.R_s * L_r + t.R_r * L_s) / whole, a_0 = t.R_s * t.R_r / whole;
  const double b_1 = L_r / whole, b_0 = t.R_r / whole;
  const double apart = h.h_0 - h.h_1;
  const double sum = h.h_0 + h.h_1 - a_1, weighted = h.h_0 * h.h_1 - a_0;
  return {(b_0 - b_1 * h.h_1) / apart, (b_1 * h.h_0 - b_0) / apart, (weighted - h.h_1 * sum) / apart,
          (h.h_0 * sum - weighted) / apart};
}

std::optional<TCircuit> circuit_of(const RegressionVector& c, const StandstillFilters& h) {
  const double b_1 = c[0] + c[1], b_0 = h.h_0 * c[0] + h.h_1 * c[1];
  const double a_1 = h.h_0 + h.h_1 - c[2] - c[3];
  const double a_0 = h.h_0 * h.h_1 - h.h_1 * c[3] - h.h_0 * c[2];
  const double R_s = a_0 / b_0, R_r = a_1 / b_1 - R_s;
  const double L_s = R_r * b_1 / b_0, square = L_s * L_s - L_s / b_1;
  if (!(R_s > 0.0 && R_r > 0.0 && L_s > 0.0 && b_1 > 0.0 && square > 0.0)) return std::nullopt;
  const double L_m = std::sqrt(square);
  return TCircuit{R_s, R_r, L_s - L_m, L_s - L_m, L_m};
}

}  // namespace imrig::est
