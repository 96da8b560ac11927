// imrig model show M: a model file for people and programs, beside the emulator's truth where there is one. convert and
// export: model_circuits.h.

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <memory>

#include "estimators/model/model_file.h"
#include "rig/base/error.h"
#include "rig/base/file.h"
#include "rig/cli/json_number.h"
#include "rig/cli/model_effects.h"
#include "rig/cli/model_circuits.h"
#include "rig/cli/text_table.h"
#include "rig/cli/verbs.h"

namespace imrig {

namespace {

struct Options {
  std::string model;
  std::string truth;
  bool json = false;
};

// Base parameters by name, as printed by "imrig-emulator truth --json".
std::map<std::string, double> read_truth(const std::string& path) {
  const Json json = Json::parse(read_text(path, std::size_t{1} << 24), nullptr, false);
  const std::string right = "the output of imrig-emulator truth --json is needed";
  if (json.is_discarded()) throw Error(path, "is no JSON", right);
  if (!json.is_object() || !json.contains("parameters") || !json["parameters"].is_object())
    throw Error(path, "has no \"parameters\"", right);
  std::map<std::string, double> truth;
  for (const auto& base : est::base_parameters()) {
    const auto found = json["parameters"].find(base.name);
    if (found == json["parameters"].end()) continue;
    if (!found->is_object() || !found->contains("value") || !(*found)["value"].is_number()) {
      throw Error(path, fmt::format("parameters.{} has no value", base.name), right);
    }
    const std::string unit = found->value("unit", base.unit);
    if (unit != base.unit)
      throw Error(path, fmt::format("parameters.{} is in {}", base.name, unit),
                  fmt::format("it must be in {}", base.unit));
    truth[base.name] = (*found)["value"].get<double>();
  }
  if (truth.empty()) throw Error(path, "names none of R_s, R_r, L_l, L_m", right);
  return truth;
}

Json parameter_json(const est::Parameter& p, const char* unit) {
  return {{"value", json_number(p.value)},
          {"ci95", {json_number(p.ci95_low), json_number(p.ci95_high)}},
          {"unit", unit},
          {"found", p.found}};
}

Json history_json(const est::Revision& r) {
  return {{"number", r.number},
          {"change", r.change},
          {"data", r.data},
          {"data_hash", fmt::format("{:016x}", r.data_hash)},
          {"fitted_nrmse", json_number(r.fitted_nrmse)},
          {"holdout_nrmse", json_number(r.holdout_nrmse)},
          {"floor_nrmse", json_number(r.floor_nrmse)}};
}

Json effect_json(const est::ActiveEffect& effect) {
  Json parameters = Json::object();
  for (const auto& [name, p] : effect.parameters) parameters[name] = parameter_json(p, p.unit.c_str());
  return {{"name", effect.name}, {"parameters", parameters}};
}

Json truth_json(const est::Model& model, const std::map<std::string, double>& truth) {
  Json out = Json::object();
  for (const auto& base : est::base_parameters()) {
    const auto found = truth.find(base.name);
    if (found == truth.end()) continue;
    const est::Parameter& p = model.*base.place;
    const bool told = !std::isnan(p.ci95_low) && !std::isnan(p.ci95_high);
    out[base.name] = {{"true", json_number(found->second)},
                      {"value", json_number(p.value)},
                      {"error_percent", json_number(100.0 * (p.value / found->second - 1.0))},
                      {"in_interval", told ? Json(found->second >= p.ci95_low && found->second <= p.ci95_high)
                                           : Json(nullptr)}};
  }
  return out;
}

void print_json(const est::Model& model, const std::map<std::string, double>& truth) {
  Json out = {{"version", 1},
              {"name", model.name},
              {"pole_pairs", model.pole_pairs},
              {"connection", model.delta ? "delta" : "star"},
              {"circuit", model.circuit},
              {"ratings",
               {{"voltage_V", model.ratings.voltage_V},
                {"frequency_Hz", model.ratings.frequency_Hz},
                {"current_A", model.ratings.current_A},
                {"speed_rpm", model.ratings.speed_rpm},
                {"power_W", model.ratings.power_W}}},
              {"model", Json::object()},
              {"R_s_stator_C", json_number(model.R_s_stator_C)},
              {"effects", Json::array()},
              {"history", Json::array()}};
  for (const auto& base : est::base_parameters())
    out["model"][base.name] = parameter_json(model.*base.place, base.unit);
  for (const auto& effect : model.effects) out["effects"].push_back(effect_json(effect));
  for (const auto& revision : model.history) out["history"].push_back(history_json(revision));
  if (!truth.empty()) out["truth"] = truth_json(model, truth);
  fmt::print("{}\n", json_text(out));
}

std::string interval(const est::Parameter& p) {
  return std::isnan(p.ci95_low) ? "-" : "[" + shown(p.ci95_low, 5) + ", " + shown(p.ci95_high, 5) + "]";
}

void print_parameters(const est::Model& model) {
  TextTable table({"<parameter", "value", "<95 % interval", "<unit", "<found"});
  for (const auto& base : est::base_parameters()) {
    const est::Parameter& p = model.*base.place;
    table.row({base.name, shown(p.value, 5), interval(p), base.unit, printable(p.found)});
  }
  for (const auto& effect : model.effects) {
    for (const auto& [name, p] : effect.parameters) {
      table.row({printable(effect.name + "." + name), shown(p.value, 5), interval(p), printable(p.unit),
                 printable(p.found)});
    }
  }
  fmt::print("{}", table.text());
}

void print_truth(const est::Model& model, const std::map<std::string, double>& truth) {
  TextTable table({"<parameter", "true", "identified", "<95 % interval", "error_%", "<unit", "<"});
  for (const auto& base : est::base_parameters()) {
    const auto found = truth.find(base.name);
    if (found == truth.end()) continue;
    const est::Parameter& p = model.*base.place;
    const bool outside = found->second < p.ci95_low || found->second > p.ci95_high;
    table.row({base.name, shown(found->second, 5), shown(p.value, 5), interval(p),
               p.known() ? fmt::format("{:+.3f}", 100.0 * (p.value / found->second - 1.0)) : "-", base.unit,
               outside ? "outside the interval" : ""});
  }
  fmt::print("{}", table.text());
}

void print_text(const est::Model& model, const std::map<std::string, double>& truth) {
  fmt::print("{}: {} pole pairs, motor in {}; {} circuit per phase of the {}star\n", printable(model.name),
             model.pole_pairs, model.delta ? "delta" : "star", model.circuit,
             model.delta ? "equivalent " : "");
  if (!std::isnan(model.R_s_stator_C))
    fmt::print("R_s belongs to a winding at {} degrees Celsius\n", shown(model.R_s_stator_C, 3));
  fmt::print("\n");
  truth.empty() ? print_parameters(model) : print_truth(model, truth);
  if (model.history.empty()) return;
  TextTable table({"rev", "<change", "<data", "fitted_%", "hold-out_%", "floor_%"});
  for (const auto& r : model.history) {
    table.row({std::to_string(r.number), printable(r.change), printable(r.data),
               shown(100.0 * r.fitted_nrmse, 3), shown(100.0 * r.holdout_nrmse, 3),
               shown(100.0 * r.floor_nrmse, 3)});
  }
  fmt::print("\n{}", table.text());
}

void run(const Options& options) {
  const est::Model model = est::load_model(options.model);
  std::map<std::string, double> truth;
  if (!options.truth.empty()) truth = read_truth(options.truth);
  options.json ? print_json(model, truth) : print_text(model, truth);
}

}  // namespace

void add_model(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<Options>();
  CLI::App* verb = app.add_subcommand("model", "Work with model files");
  verb->require_subcommand(1);
  CLI::App* show = verb->add_subcommand("show", "Parameters, intervals and history of a model");
  show->add_option("model", options->model, "model file")->required();
  show->add_option("--truth", options->truth, "truth.json of the emulator: also print true value and error");
  show->add_flag("--json", options->json, "print JSON");
  show->callback([options, &exit_code] {
    run(*options);
    exit_code = 0;
  });
  add_model_convert(*verb, exit_code);
  add_model_export(*verb, exit_code);
  add_model_effects(*verb, exit_code);
}

}  // namespace imrig
