#include "estimators/diagnose/diagnose_json.h"

#include <cmath>
#include <nlohmann/json.hpp>

namespace imrig::est {

namespace {

using Json = nlohmann::ordered_json;

Json number(double x) { return std::isfinite(x) ? Json(x) : Json(nullptr); }
Json name(const std::string& text) { return text.empty() ? Json(nullptr) : Json(text); }

Json candidate_json(const CandidateResult& c) {
  Json estimate = Json::object();
  for (const auto& [key, p] : c.estimate)
    estimate[key] = {
        {"value", number(p.value)}, {"ci95", {number(p.ci95_low), number(p.ci95_high)}}, {"unit", p.unit}};
  return {{"effect", c.effect},
          {"form", c.form},
          {"verdict", c.verdict},
          {"score", number(c.score)},
          {"p_value", number(c.p_value)},
          {"estimate", estimate},
          {"holdout_nrmse_before", number(c.holdout_nrmse_before)},
          {"holdout_nrmse_after", number(c.holdout_nrmse_after)},
          {"distinguishability", number(c.distinguishability)}};
}

Json whole(const Diagnosis& d) {
  Json out = {{"version", kDiagnoseJsonVersion},
              {"verdict", d.verdict},
              {"effect", name(d.effect)},
              {"confusable", d.confusable},
              {"ranked_among", d.ranked_among}};
  out["candidates"] = Json::array();
  for (const CandidateResult& c : d.candidates) out["candidates"].push_back(candidate_json(c));
  out["unexplained"] = nullptr;
  if (d.unexplained) {
    out["unexplained"] = {{"channel", d.unexplained->channel},
                          {"depends_on", name(d.unexplained->depends_on)},
                          {"lines_Hz", d.unexplained->lines_Hz},
                          {"description", d.unexplained->description}};
  }
  out["next_experiment"] = nullptr;
  if (d.next_experiment) {
    out["next_experiment"] = {
        {"kind", d.next_experiment->kind},
        {"what", d.next_experiment->what},
        {"plan", name(d.next_experiment->plan)},
        {"why", d.next_experiment->why},
        {"distinguishability_before", number(d.next_experiment->distinguishability_before)},
        {"distinguishability_after", number(d.next_experiment->distinguishability_after)}};
  }
  out["explanation"] = d.explanation;
  return out;
}

}  // namespace

std::string diagnose_json(const Diagnosis& d) {
  return whole(d).dump(2, ' ', false, Json::error_handler_t::replace);
}

std::string improve_json(const Improvement& improvement, const std::string& model_path) {
  Json out = {{"version", kDiagnoseJsonVersion}};
  out["steps"] = Json::array();
  for (const SearchChange& change : improvement.diagnosis.search.changes) {
    out["steps"].push_back({{"effect", name(change.effect)},
                            {"change", change.text},
                            {"fitted_nrmse", number(change.fitted.nrmse())},
                            {"holdout_nrmse", number(change.holdout.nrmse())},
                            {"floor_nrmse", number(change.fitted.floor())},
                            {"holdout_floor_nrmse", number(change.holdout.floor())},
                            {"fitted_chi2_per_dof", number(change.fitted.chi2_per_value())},
                            {"holdout_chi2_per_dof", number(change.holdout.chi2_per_value())},
                            {"fitted_torque_rmse_Nm", number(change.fitted.torque.rmse_Nm())},
                            {"holdout_torque_rmse_Nm", number(change.holdout.torque.rmse_Nm())}});
  }
  out["verdict"] = improvement.diagnosis.verdict;
  out["model"] = model_path;
  out["diagnosis"] = whole(improvement.diagnosis);
  return out.dump(2, ' ', false, Json::error_handler_t::replace);
}

}  // namespace imrig::est
