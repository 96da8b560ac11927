#include "rig/cli/model_effects.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "estimators/diagnose/refit_model.h"
#include "estimators/model/effects/registry.h"
#include "estimators/model/model_file.h"
#include "rig/base/error.h"
#include "rig/cli/json_number.h"
#include "rig/cli/load_data.h"
#include "rig/cli/text_table.h"

namespace imrig {

namespace {

struct Options {
  std::string model, effect, form, out;
  std::vector<std::string> data;
  bool json = false;
};

Json parameter_json(const est::EffectParameter& p) {
  const char* role = p.role == est::Role::kAmplitude ? "amplitude"
                     : p.role == est::Role::kShape   ? "shape"
                                                     : "constant";
  return {{"name", p.name},       {"unit", p.unit}, {"role", role},
          {"neutral", p.neutral}, {"low", p.low},   {"high", p.high}};
}

void print_effects_json() {
  Json out = {{"version", 1}, {"effects", Json::array()}, {"corrections", Json::array()}};
  for (const est::EffectInfo& info : est::kEffectInfos) {
    Json one = {{"name", info.name},           {"sentence", info.sentence},     {"equation", info.equation},
                {"source", info.source},       {"experiment", info.experiment}, {"forms", Json::array()},
                {"parameters", Json::array()}, {"per_record", Json::array()}};
    for (const est::EffectForm& f : info.forms) one["forms"].push_back(f.name);
    for (const est::EffectParameter& p : info.shared) one["parameters"].push_back(parameter_json(p));
    for (const est::EffectParameter& p : info.local) one["per_record"].push_back(parameter_json(p));
    out[info.correction ? "corrections" : "effects"].push_back(std::move(one));
  }
  fmt::print("{}\n", json_text(out));
}

void print_effects() {
  for (const est::EffectInfo& info : est::kEffectInfos) {
    fmt::print("{}\n  {}\n  {}\n", info.name, info.sentence, info.equation);
    if (info.correction) fmt::print("  a correction of a sensor: never named as missing\n");
    std::string forms, parameters;
    for (const est::EffectForm& f : info.forms) forms += (forms.empty() ? "" : "; ") + std::string(f.name);
    for (const est::EffectParameter& p : info.shared)
      parameters += fmt::format("{}{} [{}]", parameters.empty() ? "" : ", ", p.name, p.unit);
    for (const est::EffectParameter& p : info.local)
      parameters += fmt::format("{}{} [{}] of each record", parameters.empty() ? "" : ", ", p.name, p.unit);
    fmt::print("  forms: {}\n  parameters: {}\n  shown by: {}\n  source: {}\n\n", forms, parameters,
               info.experiment, info.source);
  }
}

const est::EffectInfo& known(const std::string& effect) {
  const auto number = est::effect_number(effect);
  if (!number)
    throw Error("effect \"" + effect + "\"", "is not in the library",
                "imrig model effects lists those there are");
  const est::EffectInfo& info = est::kEffectInfos[*number];
  if (info.correction)
    throw Error("effect \"" + effect + "\"", "is the error of a sensor, none of the motor",
                "a known one stands under [[correction]] in the model file");
  return info;
}

est::ActiveEffect neutral_effect(const est::Model& model, const Options& options) {
  const est::EffectInfo& info = known(options.effect);
  est::ActiveEffect effect;
  effect.name = info.name;
  effect.form = options.form.empty() ? info.forms.front().name : options.form;
  const bool has =
      std::any_of(info.forms.begin(), info.forms.end(), [&](const auto& f) { return effect.form == f.name; });
  if (!has)
    throw Error("effect " + effect.name, "has no form \"" + effect.form + "\"",
                "imrig model effects lists the forms");
  for (const est::EffectParameter& p : info.shared)
    effect.parameters[p.name] = {p.neutral, kMissing, kMissing, p.unit, "neutral"};
  // R_s keeps its meaning: that of a winding at the temperature that the file gives for it.
  if (effect.name == "stator_heating" && std::isfinite(model.R_s_stator_C))
    effect.parameters["reference_C"] = {model.R_s_stator_C, kMissing, kMissing, "C", "temperature of R_s"};
  return effect;
}

// Shapes that the form free now and the one wanted does not go back to their usual values.
void hold_what_goes(const est::EffectInfo& info, const std::string& wanted, est::ActiveEffect& effect) {
  const auto free_in = [&](const std::string& name, std::size_t k) {
    return std::any_of(info.forms.begin(), info.forms.end(), [&](const est::EffectForm& f) {
      return f.name == name && std::find(f.shared.begin(), f.shared.end(), k) != f.shared.end();
    });
  };
  for (std::size_t k = 0; k < info.shared.size(); ++k) {
    const est::EffectParameter& p = info.shared[k];
    if (p.role == est::Role::kShape && free_in(effect.form, k) && !free_in(wanted, k))
      effect.parameters[p.name] = {p.neutral, kMissing, kMissing, p.unit, "neutral"};
  }
}

est::Revision revision(const est::Model& model, const std::string& change) {
  est::Revision r;
  r.number = model.history.empty() ? 1 : model.history.back().number + 1;
  r.change = change;
  return r;
}

void save(est::Model model, const Options& options, const std::string& change) {
  if (options.data.empty()) {
    model.history.push_back(revision(model, change));
  } else {
    model = est::refit_model(model, load_data(options.data), change, 2);
  }
  est::save_model(model, options.out);
  fmt::print(
      "model written to {}{}\n", printable(options.out),
      options.data.empty()
          ? "; its values are as they were: refit with imrig identify --method global, or give data here"
          : "");
}

void add(const Options& options) {
  est::Model model = est::load_model(options.model);
  const auto same = std::find_if(model.effects.begin(), model.effects.end(),
                                 [&](const auto& e) { return e.name == options.effect; });
  if (same != model.effects.end()) {
    if (options.form.empty() || options.form == same->form)
      throw Error("model " + options.model, "has the effect " + options.effect + " already",
                  "--form changes its form");
    hold_what_goes(known(options.effect), neutral_effect(model, options).form, *same);
    same->form = options.form;
    save(std::move(model), options, options.effect + " as " + options.form);
    return;
  }
  model.effects.push_back(neutral_effect(model, options));
  save(std::move(model), options, "added " + options.effect);
}

void remove(const Options& options) {
  (void)known(options.effect);
  est::Model model = est::load_model(options.model);
  const auto erased = std::erase_if(model.effects, [&](const auto& e) { return e.name == options.effect; });
  if (erased == 0) throw Error("model " + options.model, "does not have the effect " + options.effect);
  save(std::move(model), options, "removed " + options.effect);
}

void history(const Options& options) {
  const est::Model model = est::load_model(options.model);
  if (options.json) {
    Json out = {{"version", 1}, {"history", Json::array()}};
    for (const est::Revision& r : model.history) {
      out["history"].push_back({{"number", r.number},
                                {"change", r.change},
                                {"data", r.data},
                                {"data_hash", fmt::format("{:016x}", r.data_hash)},
                                {"fitted_nrmse", json_number(r.fitted_nrmse)},
                                {"holdout_nrmse", json_number(r.holdout_nrmse)},
                                {"floor_nrmse", json_number(r.floor_nrmse)}});
    }
    fmt::print("{}\n", json_text(out));
    return;
  }
  TextTable table({"rev", "<change", "<data", "fitted_%", "hold-out_%", "floor_%"});
  for (const est::Revision& r : model.history) {
    table.row({std::to_string(r.number), printable(r.change), printable(r.data),
               shown(100.0 * r.fitted_nrmse, 3), shown(100.0 * r.holdout_nrmse, 3),
               shown(100.0 * r.floor_nrmse, 3)});
  }
  fmt::print("{}", table.text());
}

}  // namespace

void add_model_effects(CLI::App& model, int& exit_code) {
  const auto options = std::make_shared<Options>();
  const auto verb = [&](const char* name, const char* text, auto action) {
    CLI::App* sub = model.add_subcommand(name, text);
    sub->callback([options, action, &exit_code] {
      action(*options);
      exit_code = 0;
    });
    return sub;
  };
  CLI::App* effects = verb("effects", "The library of effects: physics, equation, forms, parameters",
                           [](const Options& o) { o.json ? print_effects_json() : print_effects(); });
  effects->add_flag("--json", options->json, "print JSON");
  CLI::App* log = verb("history", "What was added and removed, and where it left the errors", history);
  log->add_option("model", options->model, "model file")->required();
  log->add_flag("--json", options->json, "print JSON");
  const std::pair<CLI::App*, bool> changes[] = {
      {verb("add", "Add an effect of the library to a model", add), true},
      {verb("remove", "Take an effect out of a model", remove), false}};
  for (const auto& [sub, forms] : changes) {
    sub->add_option("model", options->model, "model file")->required();
    sub->add_option("effect", options->effect, "its name")->required();
    if (forms)
      sub->add_option("--form", options->form, "one of the effect's forms; the plainest if not given");
    sub->add_option("--out", options->out, "model file to write")->required();
    sub->add_option("--data", options->data, "refit to these data-set folders or event logs");
  }
}

}  // namespace imrig
