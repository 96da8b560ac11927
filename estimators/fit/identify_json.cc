#include "estimators/fit/identify_json.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "estimators/fit/standstill/standstill_json.h"
#include "estimators/model/convert.h"

namespace imrig::est {

namespace {

using Json = nlohmann::ordered_json;

Json number(double x) { return std::isfinite(x) ? Json(x) : Json(nullptr); }
Json text_or_null(const std::string& text) { return text.empty() ? Json(nullptr) : Json(text); }

Json parameters_of(const Model& model, double factor) {
  Json out = Json::object();
  for (const auto& base : base_parameters()) {
    const Parameter& p = model.*base.place;
    if (!p.known()) continue;
    out[base.name] = {{"value", number(factor * p.value)},
                      {"ci95", {number(factor * p.ci95_low), number(factor * p.ci95_high)}},
                      {"unit", base.unit},
                      {"found", p.found},
                      {"determined", !is_start(p)}};
  }
  return out;
}

Json estimate_of(const RecordEstimate& e) {
  return {{"value", number(e.value)},
          {"sigma", number(e.sigma)},
          {"unit", e.unit},
          {"sensitivity", number(e.sensitivity)},
          {"left_out", text_or_null(e.left_out)}};
}

Json record_of(const RecordResult& row) {
  Json parameters = Json::object();
  for (const auto& [name, estimate] : row.parameters) parameters[name] = estimate_of(estimate);
  Json out{{"id", row.id},
           {"kind", record_kind_word(row.kind)},
           {"holdout", row.holdout},
           {"used_for", row.used_for},
           {"rejected", text_or_null(row.rejected)},
           {"parameters", parameters},
           {"conditions",
            {{"f_Hz", number(row.f_Hz)},
             {"slip", number(row.slip)},
             {"v_V", number(row.v_peak_V)},
             {"i_A", number(row.i_peak_A)}}},
           {"nrmse", number(row.nrmse)},
           {"chi2_per_dof", number(row.chi2_per_dof)},
           {"notes", row.notes}};
  if (row.standstill) out["standstill"] = standstill_json(*row.standstill);
  return out;
}

}  // namespace

std::string to_json(const IdentifyResult& result) {
  Json out;
  out["version"] = 1;
  out["circuit"] = result.model.circuit;
  out["pole_pairs"] = result.model.pole_pairs;
  out["connection"] = result.model.delta ? "delta" : "star";
  out["model"] = parameters_of(result.model, 1.0);
  if (result.model.delta) out["model_delta_phase"] = parameters_of(result.model, 3.0);
  out["R_s_stator_C"] = number(result.model.R_s_stator_C);
  out["records"] = Json::array();
  for (const auto& row : result.records) out["records"].push_back(record_of(row));
  out["notes"] = result.notes;
  return out.dump(2) + "\n";
}

}  // namespace imrig::est
