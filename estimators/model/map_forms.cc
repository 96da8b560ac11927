#include "estimators/model/map_forms.h"

namespace imrig::est {

const std::vector<MapForm>& map_forms() {
  static const std::vector<MapForm> forms{
      {"R_s", "R_20 (1 + alpha (T_stator - 20 C))", {{"R_20", "ohm"}, {"alpha", "1/K"}}},
      {"L_m",
       "L_0 for I_d up to the knee, k_1 I_d^2 + k_2 I_d + k_3 above it, held beyond lowest and highest",
       {{"L_0", "H"},
        {"k_1", "H/A^2"},
        {"k_2", "H/A"},
        {"k_3", "H"},
        {"knee", "A"},
        {"lowest", "A"},
        {"highest", "A"}}},
      {"L_l", "k_4 I + k_5, held beyond lowest and highest", {{"k_4", "H/A"}, {"k_5", "H"}, {"lowest", "A"}, {"highest", "A"}}},
      {"R_r",
       "kappa (R_1 (1 + per_K (T_stator - reference)) + k_6 w_s)",
       {{"R_1", "ohm"}, {"per_K", "1/K"}, {"k_6", "ohm s"}, {"reference", "C"}}},
      {"rotor_bars",
       "in place of k_6 w_s: R_2' u^2/(1 + u^2), R_2' = R_2 R_1(T)/R_1, u = w_s L_2/R_2'; L_l falls by L_2 u^2/(1 + u^2)",
       {{"R_2", "ohm"}, {"L_2", "H"}, {"R_1", "ohm"}}},
      {"core_loss",
       "hysteresis (w/w_0) x^exponent + eddy (w/w_0)^2 x^2, x = (psi/psi_0) sqrt(1 + rise (psi/psi_0)^rise_exponent), psi of the rotor",
       {{"hysteresis", "W"}, {"eddy", "W"}, {"exponent", "1"}, {"w_0", "rad/s"}, {"psi_0", "Wb"}, {"rise", "1"}, {"rise_exponent", "1"}}},
      {"friction_windage",
       "coulomb + viscous w_M + windage w_M^2",
       {{"coulomb", "Nm"}, {"viscous", "Nm s"}, {"windage", "Nm s^2"}}},
      {"stray_drag",
       "drag |i_s|^2 (w_M / 1 rad/s)^(exponent - 1), |i_s| peak",
       {{"drag", "Nm/A^2"}, {"exponent", "1"}}}};
  return forms;
}

}  // namespace imrig::est
