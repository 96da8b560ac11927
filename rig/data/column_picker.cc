#include "rig/data/column_picker.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "rig/base/error.h"
#include "rig/data/unit_row.h"

namespace imrig {

namespace {
std::string some_of(const std::vector<std::string>& names) {
  std::string all;
  for (std::size_t k = 0; k < names.size() && k < 20; ++k) all += (k == 0 ? "" : ", ") + names[k];
  return names.size() > 20 ? all + ", ..." : all;
}
}  // namespace

ColumnPicker::ColumnPicker(const RecordSpec& spec, const ColumnTable& table) : spec_(spec), table_(table) {
  for (const auto& [name, rule] : spec.columns) has(name);
}

std::string ColumnPicker::source_of(const std::string& name) const {
  const auto rule = spec_.columns.find(name);
  return rule == spec_.columns.end() ? name : rule->second.from;
}

bool ColumnPicker::has(const std::string& name) const {
  const std::string source = source_of(name);
  if (table_.find(source) >= 0) return true;
  if (!spec_.columns.contains(name)) return false;
  throw Error(
      spec_.where,
      fmt::format("columns.{} is taken from \"{}\", which {} does not have", name, source, table_.file),
      "it has " + some_of(table_.names));
}

std::vector<double> ColumnPicker::take(const std::string& name) {
  if (!has(name)) return {};
  const std::string source = source_of(name);
  std::vector<double> x = table_.columns[static_cast<std::size_t>(table_.find(source))];
  if (taken_.empty()) rows_ = x.size();
  if (x.size() != rows_) {
    throw Error(table_.file,
                fmt::format("\"{}\" has {} values, \"{}\" has {}", source, x.size(), taken_.front(), rows_),
                "columns of one record must be of one length");
  }
  taken_.push_back(source);
  const auto rule = spec_.columns.find(name);
  if (rule == spec_.columns.end() || !rule->second.scaled) check_unit(name, source);
  if (rule == spec_.columns.end() || (rule->second.scale == 1.0 && rule->second.offset == 0.0)) return x;
  for (double& value : x) value = rule->second.scale * value + rule->second.offset;
  return x;
}

void ColumnPicker::check_unit(const std::string& name, const std::string& source) const {
  if (table_.units.empty()) return;
  const std::string& told = table_.units[static_cast<std::size_t>(table_.find(source))];
  const double factor = unit_factor(name, told).value_or(1.0);
  if (std::abs(factor - 1.0) < 1e-9) return;
  if (std::isnan(factor)) {
    throw Error(
        table_.file,
        fmt::format("\"{}\" is in {} by the row under the names, and {} is read from it", source, told, name),
        fmt::format(
            "take another column, or say that the row is wrong: columns.{} = {{ from = \"{}\", scale = 1 }}",
            name, source));
  }
  throw Error(table_.file,
              fmt::format("\"{}\" is in {} by the row under the names, and {} is read from it as it is",
                          source, told, name),
              fmt::format("columns.{} = {{ from = \"{}\", scale = {:.12g} }}", name, source, factor));
}

std::vector<double> ColumnPicker::need(const std::string& name) {
  if (!has(name)) {
    throw Error(table_.file, fmt::format("column \"{}\" is missing", source_of(name)),
                fmt::format("it has {}; rename in dataset.toml with columns.{} = {{ from = \"...\" }}",
                            some_of(table_.names), name));
  }
  return take(name);
}

std::vector<std::string> ColumnPicker::unused() const {
  std::vector<std::string> left;
  for (const auto& name : table_.names) {
    if (std::find(taken_.begin(), taken_.end(), name) == taken_.end()) left.push_back(name);
  }
  return left;
}

}  // namespace imrig
