// Who may include whom, as docs/architecture.md says: read from the sources themselves.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

const fs::path kRoot = IMRIG_SOURCE_DIR;

struct Include {
  std::string file;  // relative to the root
  std::string target;
  bool quoted = false;
};

std::vector<Include> all_includes() {
  static const std::regex kLine(R"re(^\s*#\s*include\s*(["<])([^">]+)[">])re");
  std::vector<Include> all;
  for (const char* top : {"rig", "plant", "estimators"}) {
    for (const auto& entry : fs::recursive_directory_iterator(kRoot / top)) {
      const auto extension = entry.path().extension();
      if (extension != ".h" && extension != ".cc" && extension != ".c") continue;
      std::ifstream file(entry.path());
      std::string line;
      std::smatch match;
      while (std::getline(file, line)) {
        if (std::regex_search(line, match, kLine)) {
          all.push_back({fs::relative(entry.path(), kRoot).string(), match[2], match[1] == "\""});
        }
      }
    }
  }
  return all;
}

// "rig/bus", "plant", "estimators/fit"; empty for anything that is not a room.
std::string room_of(const std::string& path) {
  static const std::regex kRoom(R"re(^(rig/[a-z]+|estimators/[a-z]+|plant)/)re");
  std::smatch match;
  return std::regex_search(path, match, kRoom) ? match[1].str() : "";
}

bool is_main(const std::string& file) { return file.ends_with("_main.cc"); }

const std::map<std::string, std::set<std::string>> kMayInclude = {
    {"rig/base", {}},
    {"rig/data", {"rig/base"}},
    {"rig/bus", {"rig/base", "rig/data"}},
    {"rig/link", {"rig/base"}},
    {"rig/safety", {"rig/base", "rig/bus"}},
    {"rig/bridge", {"rig/base", "rig/bus", "rig/safety", "rig/link"}},
    {"rig/dyno", {"rig/base", "rig/bus", "rig/safety"}},
    {"rig/recorder", {"rig/base", "rig/bus", "rig/safety"}},
    {"rig/campaign", {"rig/base", "rig/data", "rig/bus", "rig/safety"}},
    {"rig/cli",
     {"rig/base", "rig/data", "rig/bus", "rig/safety", "rig/campaign", "estimators/model", "estimators/fit",
      "estimators/diagnose"}},
    {"estimators/model", {"rig/base", "rig/data"}},
    {"estimators/fit", {"rig/base", "rig/data", "estimators/model"}},
    {"estimators/online", {"rig/base", "rig/data", "estimators/model"}},
    {"estimators/diagnose", {"rig/base", "rig/data", "estimators/model", "estimators/fit"}},
    {"plant", {"rig/base", "rig/link"}},
};

TEST(Rooms, IncludeOnlyWhomTheyMayKnow) {
  int seen = 0;
  for (const auto& include : all_includes()) {
    const std::string from = room_of(include.file);
    const std::string to = room_of(include.target);
    if (to.empty() || from == to) continue;
    ++seen;
    ASSERT_TRUE(kMayInclude.contains(from)) << from << " is not in the table of rooms";
    const bool main_to_bus = is_main(include.file) && from.starts_with("estimators/") && to == "rig/bus";
    EXPECT_TRUE(kMayInclude.at(from).contains(to) || main_to_bus) << include.file << " includes " << include.target;
  }
  EXPECT_GT(seen, 50);
}

TEST(Rooms, PlantAndEstimatorsNeverMeet) {
  for (const auto& include : all_includes()) {
    const bool plant_side = include.file.starts_with("plant/") && include.target.starts_with("estimators/");
    const bool estimator_side = include.file.starts_with("estimators/") && include.target.starts_with("plant/");
    EXPECT_FALSE(plant_side || estimator_side) << include.file << " includes " << include.target;
  }
}

TEST(Rooms, PlantKnowsOnlyTheDeviceSideOfTheLink) {
  for (const auto& include : all_includes()) {
    if (!include.file.starts_with("plant/") || !include.target.starts_with("rig/link/")) continue;
    EXPECT_TRUE(include.target.starts_with("rig/link/device/") || include.target == "rig/link/transport.h")
        << include.file << " includes " << include.target;
  }
}

TEST(Rooms, EachThirdPartyLibraryLivesInOneRoom) {
  const std::vector<std::pair<std::string, std::string>> homes = {
      {"lcm/", "rig/bus/"},         {"modbus", "rig/dyno/|plant/modbus"}, {"arkode/", "plant/"},
      {"sundials/", "plant/"},      {"nvector/", "plant/"},               {"nlopt", "estimators/fit/"},
      {"toml++/", "rig/base/"},     {"matio.h", "rig/data/"},             {"ceres/", "estimators/"},
      {"CLI/", "rig/|plant/|estimators/online/"}};
  for (const auto& include : all_includes()) {
    if (include.quoted) continue;
    for (const auto& [library, home] : homes) {
      if (!include.target.starts_with(library)) continue;
      EXPECT_TRUE(std::regex_search(include.file, std::regex("^(" + home + ")")))
          << include.file << " includes <" << include.target << ">, whose home is " << home;
    }
  }
}

TEST(Rooms, OnlyMainsAndTheClockReadClocks) {
  static const std::regex kClock(R"re(monotonic_us\(|wall_us\(|steady_clock|system_clock|clock_gettime|gettimeofday)re");
  for (const char* top : {"rig", "plant", "estimators"}) {
    for (const auto& entry : fs::recursive_directory_iterator(kRoot / top)) {
      const std::string file = fs::relative(entry.path(), kRoot).string();
      if (!file.ends_with("_core.cc") && !file.ends_with("_core.h")) continue;
      std::ifstream stream(entry.path());
      std::string line;
      while (std::getline(stream, line)) EXPECT_FALSE(std::regex_search(line, kClock)) << file << ": " << line;
    }
  }
}

}  // namespace
