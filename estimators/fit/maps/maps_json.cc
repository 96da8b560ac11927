#include "estimators/fit/maps/maps_json.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "estimators/fit/identify_json.h"

namespace imrig::est {

namespace {

using Json = nlohmann::ordered_json;

Json number(double x) { return std::isfinite(x) ? Json(x) : Json(nullptr); }

Json parameter(const Parameter& p) {
  return {{"value", number(p.value)},
          {"ci95", {number(p.ci95_low), number(p.ci95_high)}},
          {"unit", p.unit},
          {"found", p.found}};
}

Json table(const std::vector<CorrelationRow>& rows) {
  Json out = Json::object();
  for (const auto& row : rows) {
    Json one = {{"records", row.records}};
    for (std::size_t k = 0; k < row.value.size(); ++k) one[kConditionNames[k]] = number(row.value[k]);
    const auto name = [](int k) { return k < 0 ? Json(nullptr) : Json(kConditionNames[static_cast<std::size_t>(k)]); };
    one["strongest"] = name(row.strongest);
    one["strongest_of_all"] = name(row.strongest_of_all);
    out[row.parameter] = one;
  }
  return out;
}

Json stored(const Model& model) {
  Json out = Json::object();
  for (const auto& map : model.maps) {
    for (const auto& [name, p] : map.parameters) out[map.name][name] = parameter(p);
  }
  return out;
}

Json resistance(const ResistanceLine& line) {
  if (!line.failure.empty()) return {{"failure", line.failure}};
  Json points = Json::array();
  for (const auto& p : line.points)
    points.push_back({{"id", p.record}, {"stator_C", number(p.stator_C)}, {"R_s", number(p.R_s_ohm)}});
  return {{"R_20", parameter(line.R_20)}, {"alpha", parameter(line.alpha)}, {"points", points}};
}

Json locked(const LockedResult& result) {
  if (!result.failure.empty()) return {{"failure", result.failure}};
  Json sweeps = Json::array(), points = Json::array();
  for (const auto& sweep : result.sweeps)
    sweeps.push_back({{"stator_C", number(sweep.stator_C)}, {"R_1", parameter(sweep.R_1)}, {"records", sweep.records}});
  for (const auto& p : result.points) {
    points.push_back({{"sweep", p.sweep},
                      {"w_s", number(p.w_s)},
                      {"R_r", number(p.R_r_ohm)},
                      {"L_l", number(p.L_l_H)},
                      {"stator_C", number(p.stator_C)},
                      {"left_out", p.left_out.empty() ? Json(nullptr) : Json(p.left_out)}});
  }
  return {{"k_6", parameter(result.k_6)},
          {"line_misfit_ohm", number(result.line_misfit_ohm)},
          {"sweeps", sweeps},
          {"points", points}};
}

Json network(const TanhNetwork& net) {
  Json W_1 = Json::array(), B_1 = Json::array(), W_2 = Json::array();
  for (Eigen::Index k = 0; k < net.W_1.rows(); ++k) {
    W_1.push_back({net.W_1(k, 0), net.W_1(k, 1)});
    B_1.push_back(net.B_1[k]);
    W_2.push_back(net.W_2[k]);
  }
  return {{"W_1", W_1},
          {"B_1", B_1},
          {"W_2", W_2},
          {"B_2", net.B_2},
          {"input_mean", {net.input_mean[0], net.input_mean[1]}},
          {"input_scale", {net.input_scale[0], net.input_scale[1]}},
          {"output_mean", net.output_mean},
          {"output_scale", net.output_scale}};
}

Json losses(const CoreLossResult& core) {
  if (!core.failure.empty()) return {{"failure", core.failure}};
  const CoreLossLaw& law = core.physics;
  Json points = Json::array();
  for (const auto& p : core.points) {
    const double friction_net = core.network.at(0.0, p.w_e);
    points.push_back({{"w_e", p.w_e},
                      {"psi_r_Wb", p.psi_r_Wb},
                      {"rotor_W", p.P_rotor_W},
                      {"core_W", law.core_W(p.w_e, p.psi_r_Wb)},
                      {"network_W", core.network.at(p.psi_r_Wb, p.w_e)},
                      {"network_core_W", core.network.at(p.psi_r_Wb, p.w_e) - friction_net},
                      {"network_friction_W", friction_net},
                      {"R_c_ohm", number(law.R_c(p.w_e, p.psi_r_Wb))},
                      {"network_R_c_ohm", core.has_R_c_network
                                              ? Json(std::exp(core.R_c_network.at(p.psi_r_Wb, p.w_e)))
                                              : Json(nullptr)}});
  }
  Json out = {{"R_r", parameter(law.R_r)},
              {"fitted_physics_W", number(core.fitted_physics_W)},
              {"fitted_network_W", number(core.fitted_network_W)},
              {"held_out_physics_W", number(core.held_out.physics_W)},
              {"held_out_network_W", number(core.held_out.network_W)},
              {"better", core.held_out.physics_wins() ? "physics" : "network"},
              {"network", network(core.network)},
              {"points", points}};
  if (core.has_R_c_network) out["ln_R_c_network"] = network(core.R_c_network);
  return out;
}

Json sensitivity(const MapsResult& result) {
  Json rows = Json::array();
  for (const auto& s : result.sensitivities) {
    rows.push_back({{"id", result.base.records[s.record].id},
                    {"slip", number(s.slip)},
                    {"R_r", number(s.value.R_r)},
                    {"L_l", number(s.value.L_l)},
                    {"L_m", number(s.value.L_m)}});
  }
  return rows;
}

Json transients(const std::vector<TransientCheck>& checks) {
  Json out = Json::array();
  for (const auto& c : checks) {
    out.push_back({{"id", c.id},
                   {"holdout", c.holdout},
                   {"f_Hz", number(c.f_Hz)},
                   {"full_nrmse", number(c.full_nrmse)},
                   {"constant_nrmse", number(c.rated_nrmse)}});
  }
  return out;
}

Json validation(const Validation& v) {
  return {{"constants",
           {{"from", v.constants_from},
            {"R_s", number(v.constants.R_s)},
            {"R_r", number(v.constants.R_r)},
            {"L_l", number(v.constants.L_l)},
            {"L_m", number(v.constants.L_m)}}},
          {"input_power",
           {{"windows", v.powers.size()},
            {"related_to_W", number(v.rated_W)},
            {"full", {{"rms", number(v.rms_full)}, {"worst", number(v.worst_full)}}},
            {"held_out", {{"windows", v.held_out}, {"rms", number(v.rms_held_out)}, {"worst", number(v.worst_held_out)}}},
            {"constant", {{"rms", number(v.rms_rated)}, {"worst", number(v.worst_rated)}}}}},
          {"steps", transients(v.steps)},
          {"starts", transients(v.starts)}};
}

}  // namespace

std::string to_json(const MapsResult& result) {
  const std::string base = to_json(result.base);
  if (!result.mapped) return base;
  Json out = Json::parse(base);
  out["slip_rule"] = result.slip_rule;
  out["correlation"] = table(result.correlation);
  out["correlation_covariance"] = table(result.correlation_covariance);
  out["maps"] = stored(result.base.model);
  out["maps"]["R_s_of_T"] = resistance(result.maps.R_s);
  out["maps"]["misfit"] = {{"L_m", number(result.maps.L_m.misfit)},
                           {"L_m_under_load", number(result.maps.L_m.load_misfit)},
                           {"L_l", number(result.maps.L_l.misfit)},
                           {"R_r", number(result.maps.R_r.misfit)}};
  out["locked"] = locked(result.maps.locked);
  out["losses"] = losses(result.maps.core);
  out["sensitivity"] = sensitivity(result);
  out["validation"] = validation(result.validation);
  return out.dump(2) + "\n";
}

}  // namespace imrig::est
