#include "estimators/model/model_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "estimators/model/map_forms.h"
#include "estimators/model/effects/effect_file.h"
#include "rig/base/config_reader.h"
#include "rig/base/error.h"
#include "rig/base/file.h"
#include "rig/base/toml_text.h"

namespace imrig::est {

namespace {

constexpr Range kFinite{-1e300, 1e300};

// ---- reading

double optional_number(const ConfigReader& reader, const std::string& key, Range range) {
  return reader.has(key) ? reader.number(key, range) : kMissing;
}

Parameter read_parameter(const ConfigReader& table, Range range) {
  Parameter p;
  p.value = table.number("value", range);
  p.unit = table.text("unit");
  p.found = table.text_or("found", "");
  if (table.has("ci95")) {
    const auto ends = table.numbers("ci95", 2, 2, kFinite);
    if (ends[0] > p.value || ends[1] < p.value)
      table.fail("ci95", "does not hold the value", "it must be [low, high] around it");
    p.ci95_low = ends[0];
    p.ci95_high = ends[1];
  }
  return p;
}

void read_base(const ConfigReader& root, Model& model) {
  const ConfigReader table = root.table("parameters");
  for (const auto& entry : base_parameters()) {
    const auto one = table.table_if(entry.name);
    if (!one) continue;
    model.*entry.place = read_parameter(*one, {1e-12, 1e6});
    if ((model.*entry.place).unit != entry.unit)
      one->fail("unit", "is not right here", std::string("it must be \"") + entry.unit + "\"");
    if (entry.place == &Model::R_s) model.R_s_stator_C = optional_number(*one, "stator_C", {-100.0, 500.0});
  }
}

std::vector<ParameterMap> read_maps(const ConfigReader& root) {
  std::vector<ParameterMap> maps;
  const auto table = root.table_if("maps");
  if (!table) return maps;
  for (const MapForm& form : map_forms()) {
    const auto one = table->table_if(form.name);
    if (!one) continue;
    ParameterMap map{form.name, {}};
    for (const MapParameter& known : form.parameters) {
      const auto entry = one->table_if(known.name);
      if (!entry) continue;
      const Parameter parameter = read_parameter(*entry, kFinite);
      if (parameter.unit != known.unit)
        entry->fail("unit", "is not right here", std::string("it must be \"") + known.unit + "\"");
      map.parameters.emplace(known.name, parameter);
    }
    maps.push_back(std::move(map));
  }
  return maps;
}

Ratings read_ratings(const ConfigReader& root) {
  Ratings r;
  const auto table = root.table_if("ratings");
  if (!table) return r;
  r.voltage_V = table->number_or("voltage_V", 0.0, {0.0, 1e6});
  r.frequency_Hz = table->number_or("frequency_Hz", 0.0, {0.0, 1e4});
  r.current_A = table->number_or("current_A", 0.0, {0.0, 1e6});
  r.speed_rpm = table->number_or("speed_rpm", 0.0, {0.0, 1e6});
  r.power_W = table->number_or("power_W", 0.0, {0.0, 1e9});
  return r;
}

std::uint64_t read_hash(const ConfigReader& table) {
  const std::string text = table.text_or("data_hash", "0000000000000000");
  std::uint64_t value = 0;
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value, 16);
  if (problem != std::errc() || end != text.data() + text.size())
    table.fail("data_hash", "is \"" + text + "\"", "it must be up to 16 hexadecimal digits");
  return value;
}

Revision read_revision(const ConfigReader& table) {
  Revision r;
  r.number = static_cast<int>(table.integer("number", {0, 1e6}));
  r.change = table.text("change");
  r.data = table.text_or("data", "");
  r.data_hash = read_hash(table);
  r.fitted_nrmse = optional_number(table, "fitted_nrmse", {0.0, 1e6});
  r.holdout_nrmse = optional_number(table, "holdout_nrmse", {0.0, 1e6});
  r.floor_nrmse = optional_number(table, "floor_nrmse", {0.0, 1e6});
  return r;
}

void read_effects(const ConfigReader& root, const char* key, std::vector<ActiveEffect>& list) {
  for (const auto& table : root.tables(key)) {
    ActiveEffect effect = read_effect(table, read_parameter);
    const bool twice = std::any_of(list.begin(), list.end(), [&](const ActiveEffect& e) { return e.name == effect.name; });
    if (twice) table.fail("name", "is \"" + effect.name + "\" a second time", "an effect is in a model once");
    list.push_back(std::move(effect));
  }
}

// ---- writing

void write_number(std::string& out, const char* key, double value) {
  if (std::isfinite(value)) out += fmt::format("{} = {}\n", key, toml_number(value));
}

void write_parameter(std::string& out, const Parameter& p) {
  out += fmt::format("value = {}\n", toml_number(p.value));
  if (std::isfinite(p.ci95_low) && std::isfinite(p.ci95_high)) {
    out += fmt::format("ci95 = [{}, {}]\n", toml_number(p.ci95_low), toml_number(p.ci95_high));
  }
  out += fmt::format("unit = {}\n", toml_quoted(p.unit));
  if (!p.found.empty()) out += fmt::format("found = {}\n", toml_quoted(p.found));
}

void write_base(std::string& out, const Model& model) {
  out += "\n[parameters]\n";
  for (const auto& entry : base_parameters()) {
    const Parameter& p = model.*entry.place;
    if (!p.known()) continue;
    out += fmt::format("\n[parameters.{}]\n", entry.name);
    write_parameter(out, p);
    if (entry.place == &Model::R_s) write_number(out, "stator_C", model.R_s_stator_C);
  }
}

void write_ratings(std::string& out, const Ratings& r) {
  out += "\n[ratings]\n";
  write_number(out, "voltage_V", r.voltage_V);
  write_number(out, "frequency_Hz", r.frequency_Hz);
  write_number(out, "current_A", r.current_A);
  write_number(out, "speed_rpm", r.speed_rpm);
  write_number(out, "power_W", r.power_W);
}

void write_effect(std::string& out, const char* key, const ActiveEffect& effect) {
  out += fmt::format("\n[[{}]]\nname = {}\n", key, toml_quoted(effect.name));
  if (!effect.form.empty()) out += fmt::format("form = {}\n", toml_quoted(effect.form));
  for (const auto& [name, parameter] : effect.parameters) {
    out += fmt::format("[{}.parameters.{}]\n", key, name);
    write_parameter(out, parameter);
  }
}

void write_map(std::string& out, const ParameterMap& map) {
  for (const auto& [name, parameter] : map.parameters) {
    if (!parameter.known()) continue;
    out += fmt::format("\n[maps.{}.{}]\n", map.name, name);
    write_parameter(out, parameter);
  }
}

void write_revision(std::string& out, const Revision& r) {
  out += fmt::format("\n[[history]]\nnumber = {}\nchange = {}\ndata = {}\ndata_hash = \"{:016x}\"\n",
                     r.number, toml_quoted(r.change), toml_quoted(r.data), r.data_hash);
  write_number(out, "fitted_nrmse", r.fitted_nrmse);
  write_number(out, "holdout_nrmse", r.holdout_nrmse);
  write_number(out, "floor_nrmse", r.floor_nrmse);
}

}  // namespace

Model parse_model(const std::string& text, const std::string& name) {
  const ConfigReader root = ConfigReader::from_text(text, name);
  const long long version = root.integer("version");
  if (version != kModelFileVersion)
    root.fail("version", fmt::format("is {}", version), "this imrig reads version 1");
  Model model;
  model.name = root.text_or("name", "motor");
  model.pole_pairs = static_cast<int>(root.integer("pole_pairs", {1, 100}));
  model.delta = root.choice_or("connection", {"star", "delta"}, "star") == "delta";
  model.circuit = root.choice("circuit", {kInverseGamma});
  model.ratings = read_ratings(root);
  read_base(root, model);
  read_effects(root, "effect", model.effects);
  read_effects(root, "correction", model.corrections);
  model.maps = read_maps(root);
  for (const auto& revision : root.tables("history")) model.history.push_back(read_revision(revision));
  root.finish();
  return model;
}

Model load_model(const std::string& path) { return parse_model(read_text(path, std::size_t{1} << 24), path); }

std::string to_toml(const Model& model) {
  std::string out =
      "# imrig model; parameters per phase of the equivalent star, SI units. docs/model-file.md\n";
  out += fmt::format("version = {}\nname = {}\npole_pairs = {}\nconnection = \"{}\"\ncircuit = {}\n",
                     kModelFileVersion, toml_quoted(model.name), model.pole_pairs, model.delta ? "delta" : "star",
                     toml_quoted(model.circuit));
  write_ratings(out, model.ratings);
  write_base(out, model);
  for (const auto& effect : model.effects) write_effect(out, "effect", effect);
  for (const auto& effect : model.corrections) write_effect(out, "correction", effect);
  for (const auto& map : model.maps) write_map(out, map);
  for (const auto& revision : model.history) write_revision(out, revision);
  return out;
}

void save_model(const Model& model, const std::string& path) { write_text_atomically(path, to_toml(model)); }

}  // namespace imrig::est
