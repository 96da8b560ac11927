// Standstill identification through the whole rig: plan, emulator, log, identify, compare.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/e2e/command.h"

namespace imrig::test {
namespace {

using nlohmann::json;

// The linear 5 hp bench with 20 mA of current noise, and 50 mV on the voltage, a quarter of a count; gains
// and zeros as they are.
std::string plant(const Folder& folder) {
  std::stringstream text;
  text << std::ifstream(source("models/plants/proca_5hp.toml")).rdbuf();
  std::string out = text.str();
  for (const auto& [from, to] :
       std::map<std::string, std::string>{{"current_noise_A = 0.03", "current_noise_A = 0.02"},
                                          {"voltage_noise_V = 0.3", "voltage_noise_V = 0.05"}}) {
    const auto at = out.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    out.replace(at, from.size(), to);
  }
  const std::string path = folder / "plant.toml";
  std::ofstream(path) << out;
  return path;
}

void take(const std::string& plan, const Folder& folder) {
  const auto done = run({"imrig", "campaign", "run", source(plan), "--emulate", plant(folder), "--pace",
                         "max", "--out", folder / "run"});
  ASSERT_EQ(done.exit_code, 0) << done.out << done.err;
}

TEST(StandstillIdentification, TellsAllFourParametersFromTenSecondsWithoutADcTest) {
  const Folder folder;
  take("campaigns/standstill_slow.toml", folder);
  const auto found = run(
      {"imrig", "identify", folder / "run", "--method", "standstill", "--out", folder / "m.toml", "--json"});
  ASSERT_EQ(found.exit_code, 0) << found.err;
  const json record = json::parse(found.out).at("records").at(0);
  EXPECT_TRUE(record.at("rejected").is_null());
  const json t = record.at("standstill").at("t");
  // T circuit of the plant's R_r 0.22, L_l 0.006, L_m 0.068.
  struct Wanted {
    const char* name;
    double value, tolerance;
  };
  for (const Wanted& w : {Wanted{"R_s", 0.39, 0.003}, Wanted{"R_r", 0.2394118, 0.01},
                          Wanted{"L_s", 0.074, 0.01}, Wanted{"L_m", 0.0709366, 0.01}}) {
    const double error = t.at(w.name).at("value").get<double>() / w.value - 1.0;
    fmt::print("{}: {:+.3f} %\n", w.name, 100.0 * error);
    EXPECT_LT(std::abs(error), w.tolerance) << w.name;
  }
  EXPECT_LT(record.at("chi2_per_dof").get<double>(), 1.3);
  EXPECT_TRUE(record.at("standstill").at("published").at("c").is_array());
}

TEST(StandstillIdentification, RefusesTonesThatCannotSeparateTheParametersAndTakesADcTestsHelp) {
  const Folder folder;
  take("campaigns/standstill.toml", folder);
  const auto alone =
      run({"imrig", "identify", folder / "run", "--method", "standstill", "--out", folder / "m.toml"});
  EXPECT_EQ(alone.exit_code, 2) << alone.out;
  EXPECT_NE(alone.err.find("cannot separate"), std::string::npos) << alone.err;
  EXPECT_NE(alone.err.find("L_m"), std::string::npos) << alone.err;
  const auto helped = run({"imrig", "identify", folder / "run", "--out", folder / "m.toml", "--json"});
  ASSERT_EQ(helped.exit_code, 0) << helped.err;
  const json model = json::parse(helped.out).at("model");
  for (const char* name : {"R_s", "R_r", "L_l", "L_m"}) EXPECT_TRUE(model.contains(name)) << name;
  EXPECT_NEAR(model.at("L_m").at("value").get<double>(), 0.068, 0.05 * 0.068);
}

TEST(StandstillIdentification, PredictsTheVoltsPerHertzRunAtThreeHundredRpm) {
  const Folder folder;
  take("campaigns/fang_vf_check.toml", folder);
  ASSERT_EQ(run({"imrig", "identify", folder / "run", "--method", "standstill", "--out", folder / "m.toml"})
                .exit_code,
            0);
  const auto compared = run({"imrig", "compare", folder / "m.toml", folder / "run", "--json"});
  ASSERT_EQ(compared.exit_code, 0) << compared.err;
  const json out = json::parse(compared.out);
  const double error = out.at("holdout").at("nrmse").get<double>();
  fmt::print("current error over start and run to 300 rpm: {:.2f} %\n", 100.0 * error);
  EXPECT_LT(error, 0.02);
}

}  // namespace
}  // namespace imrig::test
