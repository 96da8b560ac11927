#include "estimators/diagnose/compare_json.h"

#include <cmath>
#include <nlohmann/json.hpp>

namespace imrig::est {

namespace {

using Json = nlohmann::ordered_json;

Json number(double x) { return std::isfinite(x) ? Json(x) : Json(nullptr); }

Json conditions_json(const Conditions& c) {
  return {{"f_Hz", number(c.f_Hz)},         {"v_V", number(c.v_V)},
          {"slip", number(c.slip)},         {"i_A", number(c.i_A)},
          {"psi_Wb", number(c.psi_Wb)},     {"torque_Nm", number(c.torque_Nm)},
          {"stator_C", number(c.stator_C)}, {"speed_rpm", number(rpm_of_rad_s(c.speed_rad_s))}};
}

Json channels_json(const std::map<std::string, ChannelResult>& channels) {
  Json out = Json::object();
  for (const auto& [name, c] : channels) {
    out[name] = {
        {"rmse", number(c.rmse)},   {"nrmse", number(c.nrmse)}, {"chi2_per_dof", number(c.chi2_per_dof)},
        {"floor", number(c.floor)}, {"unit", c.unit},           {"values", c.values}};
  }
  return out;
}

Json point_json(const PointResult& point) {
  Json channels = Json::object();
  for (const auto& [name, pair] : point.channels) {
    channels[name] = {{"measured", number(pair.measured)}, {"predicted", number(pair.predicted)}};
  }
  return {{"conditions", conditions_json(point.conditions)}, {"channels", channels}};
}

Json record_json(const ComparedRecord& record) {
  Json out = {{"id", record.id},
              {"kind", record_kind_word(record.kind)},
              {"holdout", record.holdout},
              {"left_out", record.left_out.empty() ? Json(nullptr) : Json(record.left_out)},
              {"floor_from", record.floor_from.empty() ? Json(nullptr) : Json(record.floor_from)},
              {"conditions", conditions_json(record.conditions)},
              {"channels", channels_json(record.channels)}};
  if (record.points.empty()) return out;
  out["points"] = Json::array();
  for (const auto& point : record.points) out["points"].push_back(point_json(point));
  return out;
}

Json pooled_json(const PooledResult& pooled) {
  return {{"records", pooled.records},
          {"nrmse", number(pooled.nrmse)},
          {"chi2_per_dof", number(pooled.chi2_per_dof)},
          {"floor_nrmse", number(pooled.floor_nrmse)}};
}

}  // namespace

std::string compare_json(const CompareResult& result) {
  Json out = {{"version", kCompareJsonVersion}, {"model", result.model_name}, {"data", result.data_name}};
  out["records"] = Json::array();
  for (const auto& record : result.records) out["records"].push_back(record_json(record));
  out["fitted"] = pooled_json(result.fitted);
  out["holdout"] = pooled_json(result.holdout);
  out["notes"] = result.notes;
  // Text from data may hold any bytes; JSON must stay readable.
  return out.dump(2, ' ', false, Json::error_handler_t::replace);
}

}  // namespace imrig::est
