#pragma once
// The linear parametric model of Fang, Lin and Wang 2005, equations (8) to (23), signs corrected:
//   i/u = (b_1 s + b_0)/(s^2 + a_1 s + a_0)                              motor at standstill, T circuit, L_s
//   = L_r i = c . w,  w = [u/(s+h_1), u/(s+h_0), i/(s+h_1), i/(s+h_0)] c_1 = (b_0 - b_1 h_1)/(h_0 - h_1), c_2
//   = (b_1 h_0 - b_0)/(h_0 - h_1), c_3 + c_4 = h_0 + h_1 - a_1, h_0 c_3 + h_1 c_4 = h_0 h_1 - a_0
// and back: b_1 = c_1 + c_2, b_0 = h_0 c_1 + h_1 c_2, a_1 = h_0 + h_1 - c_3 - c_4, a_0 = h_0 h_1 - h_1 c_4 -
// h_0 c_3,
//   R_s = a_0/b_0, R_r = a_1/b_1 - R_s, L_s = L_r = R_r b_1/b_0, L_m = sqrt(L_s^2 - L_s/b_1).
// The paper prints (21) with h_1 - h_0; h_1 + h_0 follows from (18).

#include <array>
#include <optional>

#include "estimators/model/convert.h"

namespace imrig::est {

struct StandstillFilters {
  double h_0 = 40.0;  // rad/s
  double h_1 = 160.0;
};

using RegressionVector = std::array<double, 4>;  // c_1 .. c_4

RegressionVector regression_of(const TCircuit& t, const StandstillFilters& h);

// Nothing where the vector is no motor's: a negative resistance or inductance, or no real L_m. The circuit
// has L_ls = L_lr.
std::optional<TCircuit> circuit_of(const RegressionVector& c, const StandstillFilters& h);

}  // namespace imrig::est
