// From data that show too little to a plan that shows it, on the emulator.

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "rig/base/file.h"
#include "tests/e2e/command.h"

namespace imrig::test {
namespace {

using nlohmann::json;

const char* kPoor =
    "version = 1\nname = \"poor\"\n"
    "[dc]\nlevels_A = [4, 8]\nsettle_s = 1.5\nrecord_s = 0.3\n"
    "[no_load]\nfrequencies_Hz = [40]\nvoltages_percent = [40, 45, 50]\n";

void take(const std::string& plan, const std::string& out) {
  const auto taken = run({"imrig", "campaign", "run", plan, "--emulate",
                          source("models/plants/proca_5hp.toml"), "--pace", "max", "--out", out});
  ASSERT_EQ(taken.exit_code, 0) << taken.err << taken.out;
}

std::ptrdiff_t unseen(const json& diagnosis) {
  const json& list = diagnosis.at("candidates");
  return std::count_if(list.begin(), list.end(),
                       [](const json& c) { return c.at("verdict") == "cannot tell"; });
}

TEST(NextExperiment, IsPlannedTakenAndShowsWhatTheDataCouldNot) {
  const Folder folder;
  write_text_atomically(folder / "poor.toml", kPoor);
  take(folder / "poor.toml", folder / "poor");
  const std::string model = source("models/motors/proca_keyhani_5hp.toml"),
                    rig = source("models/rigs/proca_5hp.toml");
  const std::vector<std::string> diagnose{
      "imrig", "diagnose", model, folder / "poor", "--json", "--plan", folder / "next.toml", "--rig", rig};
  const auto first = run(diagnose);
  ASSERT_EQ(first.err, "");
  const json before = json::parse(first.out);
  const json& next = before.at("next_experiment");
  ASSERT_FALSE(next.is_null());
  EXPECT_EQ(next.at("plan"), folder / "next.toml");
  EXPECT_GT(next.at("distinguishability_after").get<double>(),
            next.at("distinguishability_before").get<double>());

  const auto again = run(diagnose);
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_NE(again.err.find("--force"), std::string::npos) << again.err;
  EXPECT_EQ(std::count(again.err.begin(), again.err.end(), '\n'), 1);

  const auto checked = run({"imrig", "campaign", "check", folder / "next.toml", "--config", rig});
  EXPECT_EQ(checked.exit_code, 0) << checked.out << checked.err;
  take(folder / "next.toml", folder / "next");
  const auto second = run({"imrig", "diagnose", model, folder / "poor", folder / "next", "--json"});
  ASSERT_EQ(second.err, "");
  const json after = json::parse(second.out);
  EXPECT_GT(unseen(before), 0);
  EXPECT_LT(unseen(after), unseen(before)) << next.at("what") << ": " << next.at("why");
}

}  // namespace
}  // namespace imrig::test
