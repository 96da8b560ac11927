#include "rig/cli/load_data.h"

#include <fmt/format.h>

#include <filesystem>
#include <set>

#include "rig/base/error.h"
#include "rig/bus/log_records.h"
#include "rig/cli/campaign_folder.h"
#include "rig/data/data_hash.h"
#include "rig/data/folder.h"
#include "rig/data/quality.h"

namespace imrig {

namespace {

namespace fs = std::filesystem;

DataSet load_one(const std::string& path) {
  std::error_code problem;
  if (!fs::exists(path, problem))
    throw Error(path, "is not there", "a data-set folder, a campaign's folder or an event log is needed");
  if (is_campaign_folder(path)) return read_campaign_folder(path);
  if (fs::is_directory(path, problem)) return read_folder(path);
  if (fs::path(path).filename() == "dataset.toml") {
    const auto parent = fs::path(path).parent_path();
    return read_folder(parent.empty() ? "." : parent.string());
  }
  if (path.ends_with(".csv") || path.ends_with(".mat")) {
    throw Error(
        path, "is a bare table",
        "put it into a folder with a dataset.toml that says what its columns mean (docs/data-sets.md)");
  }
  return read_log(path);
}

bool same(double a, double b) { return a == b || (a != a && b != b); }

bool same(const Noise& a, const Noise& b) {
  return same(a.current_A, b.current_A) && same(a.voltage_V, b.voltage_V) &&
         same(a.speed_rad_s, b.speed_rad_s) && same(a.torque_Nm, b.torque_Nm) && same(a.power_W, b.power_W);
}

void merge(DataSet& all, DataSet next, const std::string& path) {
  if (next.pole_pairs != all.pole_pairs || next.delta != all.delta) {
    throw Error(path,
                fmt::format("has {} pole pairs in {}, the data before it {} in {}", next.pole_pairs,
                            next.delta ? "delta" : "star", all.pole_pairs, all.delta ? "delta" : "star"),
                "only data of one motor can be taken together");
  }
  if (!same(next.noise, all.noise)) {
    all.notes.push_back(
        fmt::format("{} declares another noise than \"{}\"; the latter's is taken for all", path, all.name));
  }
  std::set<std::string> known, own;
  for (const auto& record : all.records) known.insert(record.id);
  for (const auto& record : next.records) own.insert(record.id);
  const auto renamed = [&](const std::string& id) {
    std::string name = id;
    for (int copy = 2; known.contains(name); ++copy)
      name = fmt::format("{}/{}{}", next.name, id, copy == 2 ? "" : fmt::format("({})", copy));
    return name;
  };
  for (auto& record : next.records) {
    if (own.contains(record.repeat_of)) record.repeat_of = renamed(record.repeat_of);
    record.id = renamed(record.id);
    all.records.push_back(std::move(record));
  }
  all.name += " + " + next.name;
  all.notes.insert(all.notes.end(), next.notes.begin(), next.notes.end());
}

}  // namespace

DataSet load_data(const std::vector<std::string>& paths) {
  if (paths.empty()) throw Error("data", "none is named", "a data-set folder, a campaign's folder or an event log is needed");
  DataSet all = load_one(paths.front());
  for (std::size_t k = 1; k < paths.size(); ++k) merge(all, load_one(paths[k]), paths[k]);
  if (all.records.empty())
    throw Error(paths.front(), "holds no record", all.notes.empty() ? "" : all.notes.front());
  add_quality_warnings(all);
  all.hash = hash_of(all);
  return all;
}

}  // namespace imrig
