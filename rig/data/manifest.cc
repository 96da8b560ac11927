#include "rig/data/manifest.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "rig/base/config_reader.h"

namespace imrig {

namespace {

constexpr Range kPositive{1e-12, 1e12};
constexpr Range kNotNegative{0.0, 1e12};
constexpr std::size_t kMaxRecords = 100000;
constexpr std::size_t kMaxName = 200;

std::string short_text(const ConfigReader& reader, const std::string& key, const std::string& value) {
  const bool odd = std::any_of(value.begin(), value.end(),
                               [](char c) { return static_cast<unsigned char>(c) < 32 || c == 127; });
  if (value.empty() || value.size() > kMaxName || odd) {
    reader.fail(key, "is empty, too long or holds control characters",
                fmt::format("1 to {} printable characters are needed", kMaxName));
  }
  return value;
}

Quantities quantities_from(const std::string& word) {
  if (word == "line") return Quantities::kLine;
  return word == "phase" ? Quantities::kPhase : Quantities::kStarEquivalent;
}

Noise read_noise(const ConfigReader& reader) {
  Noise noise;
  noise.current_A = reader.number_or("current_A", kMissing, kPositive);
  noise.voltage_V = reader.number_or("voltage_V", kMissing, kPositive);
  noise.torque_Nm = reader.number_or("torque_Nm", kMissing, kPositive);
  noise.power_W = reader.number_or("power_W", kMissing, kPositive);
  if (reader.has("speed_rpm") && reader.has("speed_rad_s"))
    reader.fail("speed_rad_s", "is there beside speed_rpm", "one of them is enough");
  noise.speed_rad_s = rad_s_of_rpm(reader.number_or("speed_rpm", kMissing, kPositive));
  if (reader.has("speed_rad_s")) noise.speed_rad_s = reader.number("speed_rad_s", kPositive);
  return noise;
}

SetPoint read_set_point(const ConfigReader& reader) {
  SetPoint set;
  set.f_Hz = reader.number_or("f_Hz", kMissing);
  set.v_peak_V = reader.number_or("v_peak_V", kMissing);
  set.step = reader.number_or("step", kMissing);
  set.load_Nm = reader.number_or("load_Nm", kMissing);
  set.excitation_A = reader.number_or("excitation_A", kMissing);
  return set;
}

std::string join(const std::vector<std::string>& words) {
  std::string all;
  for (const auto& word : words) all += (all.empty() ? "" : ", ") + word;
  return all;
}

std::map<std::string, ColumnRule> read_columns(const ConfigReader& reader, RecordKind kind) {
  std::map<std::string, ColumnRule> rules;
  const auto& known = kind == RecordKind::kPoints ? points_columns() : series_columns();
  for (const auto& name : reader.keys()) {
    if (std::find(known.begin(), known.end(), name) == known.end()) {
      reader.fail(name, "is no column that imrig knows here", "known are " + join(known));
    }
    const ConfigReader entry = reader.table(name);
    ColumnRule rule;
    rule.from = short_text(entry, "from", entry.text_or("from", name));
    rule.scale = entry.number_or("scale", 1.0);
    rule.scaled = entry.has("scale");
    rule.offset = entry.number_or("offset", 0.0);
    if (rule.scale == 0.0) entry.fail("scale", "is 0", "it multiplies the column's values");
    rules[name] = rule;
  }
  return rules;
}

// Files stay inside the folder, so that a data set from elsewhere cannot point at anything else.
std::string checked_path(const ConfigReader& reader, const std::string& folder) {
  const std::string file = short_text(reader, "file", reader.text("file"));
  const bool climbs = file == ".." || file.starts_with("../") || file.find("/../") != std::string::npos ||
                      file.ends_with("/..");
  if (file.front() == '/' || climbs)
    reader.fail("file", "leaves the data set's folder", "copy or link the file into it");
  const bool known =
      file.ends_with(".csv") || file.ends_with(".mat") || file.ends_with(".txt") || file.ends_with(".tsv");
  if (!known) reader.fail("file", "is \"" + file + "\"", "its name must end in .csv, .tsv, .txt or .mat");
  return folder + "/" + file;
}

RecordKind read_kind(const ConfigReader& reader) {
  static const std::vector<std::string> words = {"dc",   "standstill", "locked_sweep", "no_load", "steady",
                                                 "step", "startup",    "coast_down",   "free",    "points"};
  return record_kind_from(reader.choice("kind", words)).value_or(RecordKind::kFree);
}

RecordSpec read_record(const ConfigReader& reader, const std::string& folder) {
  RecordSpec spec;
  spec.id = short_text(reader, "id", reader.text("id"));
  spec.kind = read_kind(reader);
  spec.path = checked_path(reader, folder);
  spec.sample_time_s = reader.number_or("sample_time_s", kMissing, {1e-9, 3600.0});
  spec.voltage_filter_s = reader.number_or("voltage_filter_s", 0.0, {0.0, 10.0});
  spec.first_index = reader.integer_or("first_index", 0, {0.0, 9e15});
  spec.repeat_of = reader.text_or("repeat_of", "");
  spec.holdout = reader.boolean_or("holdout", false);
  spec.where = reader.file() + ": record \"" + spec.id + "\"";
  if (const auto set = reader.table_if("set")) spec.set = read_set_point(*set);
  if (const auto columns = reader.table_if("columns")) spec.columns = read_columns(*columns, spec.kind);
  return spec;
}

void check_identifiers(const std::vector<ConfigReader>& readers, const std::vector<RecordSpec>& records) {
  std::set<std::string> known;
  for (std::size_t k = 0; k < records.size(); ++k) {
    if (!known.insert(records[k].id).second)
      readers[k].fail("id", "\"" + records[k].id + "\" is there twice", "each record needs its own");
  }
  for (std::size_t k = 0; k < records.size(); ++k) {
    const auto& other = records[k].repeat_of;
    if (other.empty()) continue;
    if (!known.contains(other) || other == records[k].id) {
      readers[k].fail("repeat_of", "is \"" + other + "\"",
                      "it must be the id of another record of this data set");
    }
  }
}

}  // namespace

const std::vector<std::string>& series_columns() {
  static const std::vector<std::string> names = {
      "t_s",         "v_a_V",     "v_b_V",          "v_c_V",     "v_alpha_V", "v_beta_V",
      "i_a_A",       "i_b_A",     "i_c_A",          "i_alpha_A", "i_beta_A",  "speed_rpm",
      "speed_rad_s", "torque_Nm", "load_torque_Nm", "stator_C",  "segment",   "gates_on"};
  return names;
}

const std::vector<std::string>& points_columns() {
  static const std::vector<std::string> names = {
      "v_rms_V",      "v_peak_V",  "f_Hz",        "i_rms_A",   "i_peak_A", "p_in_W",  "q_var",
      "power_factor", "speed_rpm", "speed_rad_s", "torque_Nm", "p_out_W",  "stator_C"};
  return names;
}

Manifest parse_manifest(const std::string& text, const std::string& name, const std::string& folder) {
  const ConfigReader reader = ConfigReader::from_text(text, name);
  Manifest manifest;
  manifest.name = short_text(reader, "name", reader.text("name"));
  manifest.pole_pairs = static_cast<int>(reader.integer("pole_pairs", {1, 100}));
  manifest.wiring.delta = reader.choice("connection", {"star", "delta"}) == "delta";
  manifest.wiring.quantities =
      quantities_from(reader.choice("quantities", {"phase", "line", "star_equivalent"}));
  if (const auto noise = reader.table_if("noise")) manifest.cells = read_noise(*noise);
  if (const auto accuracy = reader.table_if("accuracy")) {
    manifest.accuracy.current_gain = accuracy->number_or("current_gain", 0.0, {0.0, 1.0});
    manifest.accuracy.voltage_gain = accuracy->number_or("voltage_gain", 0.0, {0.0, 1.0});
  }
  const auto records = reader.tables("record");
  if (records.empty()) reader.fail("record", "is missing", "at least one [[record]] is needed");
  if (records.size() > kMaxRecords)
    reader.fail("record", "is there too often", fmt::format("at most {} are read", kMaxRecords));
  for (const auto& entry : records) manifest.records.push_back(read_record(entry, folder));
  check_identifiers(records, manifest.records);
  reader.finish();
  return manifest;
}

}  // namespace imrig
