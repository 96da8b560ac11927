// Export: star-equivalent values at full precision under the names that need no conversion, so that reading
// gives the same bits.

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <charconv>
#include <cmath>
#include <filesystem>
#include <set>

#include "rig/base/error.h"
#include "rig/base/file.h"
#include "rig/base/toml_text.h"
#include "rig/data/folder.h"

namespace imrig {

namespace {

namespace fs = std::filesystem;

void append(std::string& text, double x, const std::string& where) {
  if (std::isnan(x)) return;  // an empty cell is a missing value
  if (std::isinf(x)) throw Error(where, "holds an infinite value", "it cannot be written");
  char buffer[32];
  const auto [end, problem] = std::to_chars(buffer, buffer + sizeof buffer, x);
  text.append(buffer, end);
}

// TOML knows "1e+20" and "1.5", but an integer where a real number stood would still be read as one; both are
// accepted.
std::string number(double x) {
  std::string text;
  append(text, x, "dataset.toml");
  return text;
}

// {key = value, ...} of the values that are known; empty if none is.
std::string inline_table(const std::vector<std::pair<const char*, double>>& entries) {
  std::string all;
  for (const auto& [key, value] : entries) {
    if (!std::isnan(value)) all += fmt::format("{}{} = {}", all.empty() ? "" : ", ", key, number(value));
  }
  return all.empty() ? "" : fmt::format("{{ {} }}", all);
}

std::string file_name(std::size_t index, const std::string& id) {
  std::string plain;
  for (const char c : id.substr(0, 60)) {
    const bool safe =
        (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
    plain += safe ? c : '_';
  }
  return fmt::format("{:03}_{}.csv", index + 1, plain);
}

struct NamedColumn {
  const char* name;
  std::vector<double> values;
};

std::string csv_of(const std::vector<NamedColumn>& columns, const std::string& where) {
  std::string text;
  for (const auto& column : columns) {
    if (!text.empty()) text += ',';
    text += column.name;
  }
  text += '\n';
  const std::size_t rows = columns.front().values.size();
  for (std::size_t k = 0; k < rows; ++k) {
    for (std::size_t c = 0; c < columns.size(); ++c) {
      if (c > 0) text += ',';
      append(text, columns[c].values[k], where);
    }
    text += '\n';
  }
  return text;
}

template <class T, class Get>
std::vector<double> column(const std::vector<T>& from, Get get) {
  std::vector<double> out;
  out.reserve(from.size());
  for (const auto& x : from) out.push_back(get(x));
  return out;
}

std::vector<NamedColumn> columns_of(const TimeSeries& series) {
  const auto real = [](SpaceVector x) { return x.real(); };
  const auto imaginary = [](SpaceVector x) { return x.imag(); };
  const auto same = [](auto x) { return static_cast<double>(x); };
  std::vector<NamedColumn> all = {{"v_alpha_V", column(series.v, real)},
                                  {"v_beta_V", column(series.v, imaginary)},
                                  {"i_alpha_A", column(series.i, real)},
                                  {"i_beta_A", column(series.i, imaginary)},
                                  {"speed_rad_s", column(series.speed_rad_s, same)},
                                  {"torque_Nm", column(series.torque_Nm, same)},
                                  {"stator_C", column(series.stator_C, same)},
                                  {"segment", column(series.segment, same)},
                                  {"gates_on", column(series.gates_on, same)}};
  std::erase_if(all, [](const NamedColumn& c) { return c.values.empty(); });
  return all;
}

std::vector<NamedColumn> columns_of(const std::vector<SteadyPoint>& points) {
  const auto get = [&points](double SteadyPoint::*place) {
    return column(points, [place](const SteadyPoint& p) { return p.*place; });
  };
  return {{"v_peak_V", get(&SteadyPoint::v_peak_V)},         {"f_Hz", get(&SteadyPoint::f_Hz)},
          {"i_peak_A", get(&SteadyPoint::i_peak_A)},         {"p_in_W", get(&SteadyPoint::p_in_W)},
          {"power_factor", get(&SteadyPoint::power_factor)}, {"q_var", get(&SteadyPoint::q_var)},
          {"speed_rad_s", get(&SteadyPoint::speed_rad_s)},   {"torque_Nm", get(&SteadyPoint::torque_Nm)},
          {"p_out_W", get(&SteadyPoint::p_out_W)},           {"stator_C", get(&SteadyPoint::stator_C)}};
}

void check_lengths(const Record& record, const std::vector<NamedColumn>& columns) {
  if (columns.empty()) throw Error("record \"" + record.id + "\"", "holds no values", "it cannot be written");
  for (const auto& column : columns) {
    if (column.values.size() != columns.front().values.size()) {
      throw Error("record \"" + record.id + "\"", "has columns of different lengths", "it cannot be written");
    }
  }
}

std::string entry_of(const Record& record, const std::string& file, const std::set<std::string>& ids) {
  std::string text = fmt::format("\n[[record]]\nid = {}\nkind = \"{}\"\nfile = \"{}\"\n", toml_quoted(record.id),
                                 record_kind_word(record.kind), file);
  const TimeSeries& series = record.series;
  if (record.kind != RecordKind::kPoints)
    text += fmt::format("sample_time_s = {}\n", number(series.sample_time_s));
  if (series.voltage_filter_s != 0.0)
    text += fmt::format("voltage_filter_s = {}\n", number(series.voltage_filter_s));
  if (series.first_index != 0) text += fmt::format("first_index = {}\n", series.first_index);
  if (record.holdout) text += "holdout = true\n";
  if (ids.contains(record.repeat_of)) text += fmt::format("repeat_of = {}\n", toml_quoted(record.repeat_of));
  const SetPoint& set = record.set;
  const std::string told = inline_table({{"f_Hz", set.f_Hz},
                                         {"v_peak_V", set.v_peak_V},
                                         {"step", set.step},
                                         {"load_Nm", set.load_Nm},
                                         {"excitation_A", set.excitation_A}});
  if (!told.empty()) text += "set = " + told + "\n";
  return text;
}

std::string head_of(const DataSet& data) {
  std::string text =
      fmt::format("name = {}\npole_pairs = {}\nconnection = \"{}\"\nquantities = \"star_equivalent\"\n",
                  toml_quoted(data.name), data.pole_pairs, data.delta ? "delta" : "star");
  const std::string noise = inline_table({{"current_A", data.noise.current_A},
                                          {"voltage_V", data.noise.voltage_V},
                                          {"speed_rad_s", data.noise.speed_rad_s},
                                          {"torque_Nm", data.noise.torque_Nm},
                                          {"power_W", data.noise.power_W}});
  if (!noise.empty()) text += "noise = " + noise + "\n";
  if (data.accuracy.current_gain != 0.0 || data.accuracy.voltage_gain != 0.0) {
    text += "accuracy = " +
            inline_table({{"current_gain", data.accuracy.current_gain},
                          {"voltage_gain", data.accuracy.voltage_gain}}) +
            "\n";
  }
  return text;
}

void write_files(const DataSet& data, const std::string& folder) {
  std::set<std::string> ids;
  for (const auto& record : data.records) ids.insert(record.id);
  std::string manifest = head_of(data);
  for (std::size_t k = 0; k < data.records.size(); ++k) {
    const Record& record = data.records[k];
    const auto columns =
        record.kind == RecordKind::kPoints ? columns_of(record.points) : columns_of(record.series);
    check_lengths(record, columns);
    const std::string file = file_name(k, record.id);
    write_text_atomically(folder + "/" + file, csv_of(columns, "record \"" + record.id + "\""));
    manifest += entry_of(record, file, ids);
  }
  write_text_atomically(folder + "/dataset.toml", manifest);
}

}  // namespace

void write_folder(const DataSet& data, const std::string& folder) {
  std::error_code problem;
  const bool there = fs::exists(folder, problem);
  if (there && (!fs::is_directory(folder, problem) || !fs::is_empty(folder, problem))) {
    throw Error(folder, "is there already", "a new or empty folder is needed");
  }
  fs::path target = fs::path(folder).lexically_normal();
  if (!target.has_filename()) target = target.parent_path();
  const std::string staging = target.string() + ".part" + std::to_string(::getpid());
  fs::create_directory(staging, problem);
  if (problem) throw Error(folder, "cannot be written: " + problem.message());
  try {
    write_files(data, staging);
    fs::rename(staging, target);
  } catch (const fs::filesystem_error& e) {
    fs::remove_all(staging, problem);
    throw Error(folder, "cannot be written: " + e.code().message());
  } catch (...) {
    fs::remove_all(staging, problem);
    throw;
  }
}

}  // namespace imrig
