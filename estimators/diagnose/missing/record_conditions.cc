#include "estimators/diagnose/missing/record_conditions.h"

#include <cmath>

#include "rig/data/conditions.h"

namespace imrig::est {

std::vector<NamedCondition> record_conditions(const GlobalProblem& problem, double R_s_ohm,
                                              const std::vector<std::size_t>& which) {
  std::vector<NamedCondition> out{{"f_Hz", {}}, {"psi_Wb", {}},    {"slip", {}},     {"slip_Hz", {}},
                                  {"i_A", {}},  {"torque_Nm", {}}, {"stator_C", {}}, {"order", {}}};
  for (const std::size_t k : which) {
    const auto& entry = problem.entries()[k];
    const int pole_pairs = problem.data().pole_pairs;
    const Conditions c = entry.point.empty() ? conditions_of(*entry.record, pole_pairs, R_s_ohm)
                                             : conditions_of(entry.point.front(), pole_pairs, R_s_ohm);
    const std::array<double, 8> values{std::abs(c.f_Hz),
                                       c.psi_Wb,
                                       c.slip,
                                       c.slip * std::abs(c.f_Hz),
                                       c.i_A,
                                       c.torque_Nm,
                                       c.stator_C,
                                       static_cast<double>(entry.index)};
    for (std::size_t m = 0; m < out.size(); ++m) out[m].values.push_back(values[m]);
  }
  return out;
}

}  // namespace imrig::est
