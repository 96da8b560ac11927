// The loop that the product is for, through the command line: measure, identify, compare, learn what is
// missing, add it, watch the error fall.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "rig/base/file.h"
#include "tests/e2e/command.h"

namespace imrig::test {
namespace {

using nlohmann::json;

// A campaign on the emulator with an effect in its plant that the base model lacks, and the model that
// identify makes of it.
void measure(const Folder& folder, const std::string& effect) {
  write_text_atomically(folder / "plant.toml",
                        read_text(source("models/plants/proca_5hp.toml")) + "\n" + effect);
  const auto measured = run({"imrig", "campaign", "run", source("campaigns/quick.toml"), "--emulate",
                             folder / "plant.toml", "--pace", "max", "--out", folder / "campaign"});
  ASSERT_EQ(measured.exit_code, 0) << measured.err << measured.out;
  const auto identified = run({"imrig", "identify", folder / "campaign", "--out", folder / "model.toml"});
  ASSERT_EQ(identified.exit_code, 0) << identified.err;
}

TEST(MissingEffect, OfAPlainMotorIsNone) {
  const Folder folder;
  measure(folder, "");
  const auto diagnosed = run({"imrig", "diagnose", folder / "model.toml", folder / "campaign", "--json"});
  ASSERT_EQ(diagnosed.exit_code, 0) << diagnosed.err;
  const json answer = json::parse(diagnosed.out);
  EXPECT_EQ(answer.at("verdict"), "adequate") << answer.at("effect");
  EXPECT_TRUE(answer.at("effect").is_null());
}

TEST(MissingEffect, IsNamedAddedAndTheErrorFallsToTheFloor) {
  const Folder folder;
  measure(folder, "[effects.magnetizing_saturation]\nsaturated_ratio = 0.4\nknee_Wb = 0.3\nsoftness = 0.5\n");
  const auto diagnosed = run({"imrig", "diagnose", folder / "model.toml", folder / "campaign", "--json"});
  ASSERT_EQ(diagnosed.exit_code, 0) << diagnosed.err;
  const json answer = json::parse(diagnosed.out);
  EXPECT_EQ(answer.at("effect"), "magnetizing_saturation");
  EXPECT_EQ(answer.at("verdict"), "missing");

  const auto improved = run({"imrig", "improve", folder / "model.toml", folder / "campaign", "--out",
                             folder / "better.toml", "--json"});
  ASSERT_EQ(improved.exit_code, 0) << improved.err;
  const json steps = json::parse(improved.out).at("steps");
  ASSERT_GE(steps.size(), 2u);
  for (const auto& step : steps) {
    fmt::print("{:<60} fitted {:.5f} hold-out {:.5f} floor {:.5f}\n", step.at("change").get<std::string>(),
               step.at("fitted_nrmse").get<double>(), step.at("holdout_nrmse").get<double>(),
               step.at("floor_nrmse").get<double>());
  }
  EXPECT_LT(steps.back().at("holdout_nrmse").get<double>(),
            0.2 * steps.front().at("holdout_nrmse").get<double>());
  EXPECT_LT(steps.back().at("holdout_chi2_per_dof").get<double>(), 1.3);

  // The file that was written predicts as well as the search said, by compare's own simulation.
  const auto compared = run({"imrig", "compare", folder / "better.toml", folder / "campaign", "--json"});
  ASSERT_EQ(compared.exit_code, 0) << compared.err;
  const json holdout = json::parse(compared.out).at("holdout");
  fmt::print("compare: hold-out {:.5f}, floor {:.5f}\n", holdout.at("nrmse").get<double>(),
             holdout.at("floor_nrmse").get<double>());
  EXPECT_LT(holdout.at("nrmse").get<double>(), 1.3 * holdout.at("floor_nrmse").get<double>());

  const auto history = run({"imrig", "model", "history", folder / "better.toml"});
  EXPECT_EQ(history.exit_code, 0) << history.err;
  EXPECT_NE(history.out.find("added magnetizing_saturation"), std::string::npos) << history.out;
}

TEST(MissingEffect, CanBeAddedAndTakenOutByHand) {
  const Folder folder;
  measure(folder, "");
  const auto added = run({"imrig", "model", "add", folder / "model.toml", "core_loss", "--form",
                          "eddy currents and hysteresis", "--out", folder / "more.toml"});
  ASSERT_EQ(added.exit_code, 0) << added.err;
  const auto shown = run({"imrig", "model", "show", folder / "more.toml"});
  EXPECT_NE(shown.out.find("core_loss.eddy_S"), std::string::npos) << shown.out;
  const auto refitted = run({"imrig", "identify", folder / "campaign", "--model", folder / "more.toml",
                             "--method", "global", "--out", folder / "fitted.toml"});
  EXPECT_EQ(refitted.exit_code, 0) << refitted.err;
  const auto removed =
      run({"imrig", "model", "remove", folder / "more.toml", "core_loss", "--out", folder / "less.toml"});
  EXPECT_EQ(removed.exit_code, 0) << removed.err;
  // R_s stays that of the winding at the temperature the file gives for it.
  std::string warm = read_text(folder / "model.toml");
  warm.replace(warm.find("stator_C = 25.0"), 15, "stator_C = 27.5");
  write_text_atomically(folder / "warm.toml", warm);
  const auto heated =
      run({"imrig", "model", "add", folder / "warm.toml", "stator_heating", "--out", folder / "heated.toml"});
  ASSERT_EQ(heated.exit_code, 0) << heated.err;
  const json model = json::parse(run({"imrig", "model", "show", folder / "heated.toml", "--json"}).out);
  EXPECT_EQ(model.at("effects").back().at("parameters").at("reference_C").at("value"), 27.5);
  for (const auto& wrong :
       {std::vector<std::string>{"imrig", "model", "remove", folder / "less.toml", "core_loss", "--out",
                                 folder / "x.toml"},
        std::vector<std::string>{"imrig", "model", "add", folder / "less.toml", "gremlins", "--out",
                                 folder / "x.toml"},
        std::vector<std::string>{"imrig", "model", "add", folder / "less.toml", "core_loss", "--form",
                                 "magic", "--out", folder / "x.toml"}}) {
    const auto refused = run(wrong);
    EXPECT_EQ(refused.exit_code, 2) << wrong[2];
    EXPECT_EQ(std::count(refused.err.begin(), refused.err.end(), '\n'), 1) << refused.err;
  }
}

}  // namespace
}  // namespace imrig::test
