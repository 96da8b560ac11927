// docs/rig-configuration.md and the example rig.toml, held against the code that reads the file.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>

#include "rig/base/error.h"
#include "rig/base/file.h"
#include "rig/base/rig_config.h"

namespace imrig {
namespace {

struct Row {
  std::string unit, range, fallback;
};
using Keys = std::map<std::string, Row>;  // by "table.key"

std::string source(const std::string& path) { return std::string(IMRIG_SOURCE_DIR) + "/" + path; }

std::string trimmed(std::string text) {
  const auto from = text.find_first_not_of(" `");
  const auto to = text.find_last_not_of(" `");
  return from == std::string::npos ? "" : text.substr(from, to - from + 1);
}

// The rows of the page's tables: | `key` | unit | range | default | meaning |
Keys documented() {
  Keys keys;
  std::istringstream page(read_text(source("docs/rig-configuration.md")));
  std::string table;
  for (std::string line; std::getline(page, line);) {
    if (line.rfind("## [", 0) == 0) table = line.substr(4, line.find(']') - 4);
    if (line.rfind("| `", 0) != 0) continue;
    std::vector<std::string> cells;
    std::istringstream row(line);
    for (std::string cell; std::getline(row, cell, '|');) cells.push_back(trimmed(cell));
    EXPECT_GE(cells.size(), 5u) << line;
    keys[table + "." + cells.at(1)] = {cells.at(2), cells.at(3), cells.at(4)};
  }
  return keys;
}

// The keys of the code, with their defaults as written.
Keys written() {
  Keys keys;
  std::istringstream text(to_toml(RigConfig{}));
  std::string table;
  for (std::string line; std::getline(text, line);) {
    if (line.rfind("[", 0) == 0) table = line.substr(1, line.find(']') - 1);
    const auto equals = line.find(" = ");
    if (equals == std::string::npos || table.empty()) continue;
    keys[table + "." + line.substr(0, equals)].fallback = trimmed(line.substr(equals + 3));
  }
  return keys;
}

void set(const std::string& key, double value) {
  const auto dot = key.find('.');
  std::ostringstream text;
  text.precision(17);
  text << "version = 1\n[" << key.substr(0, dot) << "]\n" << key.substr(dot + 1) << " = " << value << "\n";
  parse_rig_config(text.str(), "test");
}

TEST(RigConfigurationPage, EveryKeyIsThereWithItsDefaultAndNoOther) {
  const Keys page = documented(), code = written();
  ASSERT_GT(code.size(), 40u);
  for (const auto& [key, row] : code) {
    ASSERT_TRUE(page.contains(key)) << key << " is not in docs/rig-configuration.md";
    EXPECT_EQ(page.at(key).fallback, row.fallback) << key;
  }
  for (const auto& [key, row] : page)
    EXPECT_TRUE(code.contains(key)) << key << " is documented and does not exist";
}

TEST(RigConfigurationPage, RangesAreThoseThatTheReaderKeeps) {
  int numbers = 0;
  for (const auto& [key, row] : documented()) {
    if (row.range.empty()) {
      EXPECT_EQ(row.fallback.front(), '"') << key << ": only texts have no range";
      continue;
    }
    const auto dots = row.range.find(" .. ");
    ASSERT_NE(dots, std::string::npos) << key;
    const double low = std::stod(row.range.substr(0, dots)), high = std::stod(row.range.substr(dots + 4));
    const bool whole = row.fallback.find('.') == std::string::npos;
    const double beyond = whole ? 1.0 : std::max(std::abs(high), 1e-3) * 1e-3;
    const double below = whole ? 1.0 : std::max(std::abs(low), 1e-15) * 1e-3;
    EXPECT_NO_THROW(set(key, low)) << key;
    EXPECT_NO_THROW(set(key, high)) << key;
    EXPECT_THROW(set(key, low - below), Error) << key;
    EXPECT_THROW(set(key, high + beyond), Error) << key;
    ++numbers;
  }
  EXPECT_GT(numbers, 35);
}

TEST(RigConfigurationPage, ExampleRigIsThePapersBench) {
  const RigConfig rig = load_rig_config(source("models/rigs/proca_5hp.toml"));
  EXPECT_EQ(rig.motor.pole_pairs, 2);
  EXPECT_EQ(rig.motor.R_s_ohm, 0.39);
  EXPECT_EQ(rig.motor.R_r_ohm, 0.22);
  EXPECT_EQ(rig.motor.L_l_H, 0.006);
  EXPECT_EQ(rig.motor.L_m_H, 0.068);
  EXPECT_EQ(rig.motor.rated_voltage_V, 220.0);
  EXPECT_EQ(rig.motor.rated_speed_rpm, 1750.0);
  // a 10 % step on the rated voltage must be possible, and the converter's 400 V must not be asked for more
  EXPECT_GT(rig.limits.voltage_V, 1.1 * rig.motor.rated_voltage_V * std::sqrt(2.0 / 3.0));
  EXPECT_LT(rig.limits.voltage_V, 400.0 / std::sqrt(3.0));
  EXPECT_GT(rig.limits.current_A, rig.motor.rated_current_A * std::sqrt(2.0));
  EXPECT_GE(rig.limits.link_silence_ms, rig.limits.device_watchdog_ms);
  EXPECT_NE(rig.hash, 0u);
}

TEST(RigConfigurationPage, ExampleRigNamesEveryKey) {
  const std::string example = read_text(source("models/rigs/proca_5hp.toml"));
  for (const auto& [key, row] : written()) {
    std::string line = key.substr(key.find('.') + 1);
    line += " = ";
    EXPECT_NE(example.find(line), std::string::npos) << key;
  }
}

}  // namespace
}  // namespace imrig
