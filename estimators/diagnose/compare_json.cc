#include "estimators/diagnose/compare_json.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "estimators/diagnose/worst_records.h"

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

Json map_json(const FailureMap& map) {
  Json out = {{"from", map.from},
              {"stretches", map.stretches},
              {"records", map.records},
              {"shuffled", map.shuffled.empty() ? Json(nullptr) : Json(map.shuffled)}};
  out["conditions"] = Json::array();
  for (const MapCondition& c : map.conditions) {
    Json bins = Json::array();
    for (const MapBin& bin : c.bins) {
      bins.push_back({{"low", number(bin.low)},
                      {"high", number(bin.high)},
                      {"stretches", bin.stretches},
                      {"records", bin.records},
                      {"channels", channels_json(bin.channels)}});
    }
    out["conditions"].push_back({{"condition", c.name},
                                 {"p_value", number(c.p_value)},
                                 {"share", number(c.share)},
                                 {"channel", c.channel},
                                 {"part", c.part.empty() ? Json(nullptr) : Json(c.part)},
                                 {"bins", bins}});
  }
  return out;
}

Json line_json(const OrderLine& line) {
  Json worst = nullptr;
  if (line.records > 0) {
    worst = {{"record", line.worst_record},
             {"f_Hz", number(line.worst.f_Hz)},
             {"amplitude_A", number(line.worst.amplitude_A)},
             {"over_noise", number(line.worst.over_noise())}};
  }
  return {{"line", line.kind.name},
          {"order", line.kind.order},
          {"hint", line.kind.hint},
          {"records", line.records},
          {"seen", line.seen},
          {"amplitude_A", number(line.amplitude_A)},
          {"over_noise", number(line.over_noise)},
          {"worst", worst}};
}

Json spectrum_json(const OrderSpectrum& spectrum) {
  if (spectrum.lines.empty()) return nullptr;
  Json out = {{"noise", spectrum.noise_known ? "known" : "beside each line"}, {"lines", Json::array()}};
  for (const OrderLine& line : spectrum.lines) out["lines"].push_back(line_json(line));
  return out;
}

Json overlay_json(const ComparedRecord& record) {
  Json t = Json::array(), measured = Json::array(), predicted = Json::array();
  for (std::size_t k = 0; k < record.overlay.t_s.size(); ++k) {
    const auto m = record.overlay.measured[k], p = record.overlay.predicted[k];
    t.push_back(number(record.overlay.t_s[k]));
    measured.push_back({number(m.real()), number(m.imag())});
    predicted.push_back({number(p.real()), number(p.imag())});
  }
  return {{"record", record.id}, {"t_s", t}, {"measured_A", measured}, {"predicted_A", predicted}};
}

}  // namespace

std::string compare_json(const CompareResult& result) {
  Json out = {{"version", kCompareJsonVersion}, {"model", result.model_name}, {"data", result.data_name}};
  out["records"] = Json::array();
  for (const auto& record : result.records) out["records"].push_back(record_json(record));
  out["fitted"] = pooled_json(result.fitted);
  out["holdout"] = pooled_json(result.holdout);
  out["maps"] = Json::array();
  for (const FailureMap& map : result.maps) out["maps"].push_back(map_json(map));
  out["spectrum"] = spectrum_json(result.spectrum);
  out["overlays"] = Json::array();
  for (const ComparedRecord* record : worst_records(result, kOverlays))
    out["overlays"].push_back(overlay_json(*record));
  out["reach"] = result.reach;
  out["notes"] = result.notes;
  // Text from data may hold any bytes; JSON must stay readable.
  return out.dump(2, ' ', false, Json::error_handler_t::replace);
}

}  // namespace imrig::est
