#include "rig/cli/campaign_folder.h"

#include <algorithm>
#include <filesystem>
#include <optional>

#include "rig/base/error.h"
#include "rig/bus/log_records.h"
#include "rig/campaign/journal.h"

namespace imrig {

namespace {

void take_over(DataSet& all, DataSet part) {
  for (Record& record : part.records) {
    std::erase_if(all.records, [&](const Record& r) { return r.id == record.id; });
    all.records.push_back(std::move(record));
  }
  all.notes.insert(all.notes.end(), part.notes.begin(), part.notes.end());
}

}  // namespace

bool is_campaign_folder(const std::string& path) {
  return std::filesystem::is_regular_file(log_part_path(path, 0));
}

DataSet read_campaign_folder(const std::string& path) {
  std::optional<DataSet> all;
  std::vector<std::string> unreadable;
  for (int part = 0; part < count_log_parts(path); ++part) {
    try {
      DataSet next = read_log(log_part_path(path, part));
      if (all) {
        take_over(*all, std::move(next));
      } else {
        all = std::move(next);
      }
    } catch (const Error& e) {
      unreadable.push_back(e.what());
    }
  }
  if (!all) throw Error(unreadable.empty() ? path + ": holds no log-000.lcm" : unreadable.front());
  all->notes.insert(all->notes.end(), unreadable.begin(), unreadable.end());
  return std::move(*all);
}

}  // namespace imrig
