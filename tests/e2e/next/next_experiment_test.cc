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

double half_width(const json& diagnosis, const std::string& effect) {
  for (const json& c : diagnosis.at("candidates")) {
    if (c.at("effect") != effect) continue;
    double widest = 0.0;
    for (const auto& [name, p] : c.at("estimate").items())
      widest = std::max(widest, 0.5 * (p.at("ci95")[1].get<double>() - p.at("ci95")[0].get<double>()));
    return widest;
  }
  return -1.0;
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

  // The effects that it was chosen for have smaller intervals than they had.
  int shown = 0;
  for (const json& c : before.at("candidates")) {
    const std::string name = c.at("effect");
    if (next.at("why").get<std::string>().find(name) == std::string::npos) continue;
    const double now = half_width(after, name), then = half_width(before, name);
    std::printf("%s: +-%g, was +-%g\n", name.c_str(), now, then);
    if (now > 0.0 && then > 0.0 && now < 0.5 * then) ++shown;
  }
  EXPECT_GE(shown, 1) << next.at("why");
}

}  // namespace
}  // namespace imrig::test
