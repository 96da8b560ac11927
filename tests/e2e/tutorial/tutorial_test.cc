// docs/missing-effect.md is run as it stands, and what its words say of the outputs must be so.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "rig/base/file.h"
#include "tests/e2e/command.h"

namespace imrig::test {
namespace {

using nlohmann::json;

constexpr int kTimeout_s = 1100;

// A copy of what the document's commands need, so that nothing is written into the sources.
void lay_out(const Folder& folder) {
  for (const char* name : {"campaigns", "models", "tests"})
    std::filesystem::create_directory_symlink(source(name), folder / name);
  std::filesystem::create_directories(folder / "build/release");
  std::filesystem::create_directory_symlink(IMRIG_BIN_DIR, folder / "build/release/bin");
  write_text_atomically(folder / "document.md", read_text(source("docs/missing-effect.md")));
}

json compared(const Folder& folder, const std::string& model, const std::string& data) {
  const auto done = run({"imrig", "compare", folder / ("out/tutorial/" + model), data, "--json"});
  EXPECT_EQ(done.exit_code, 0) << done.err;
  return json::parse(done.out);
}

double figure(const json& object, const char* name) { return object.at(name).get<double>(); }

void check_hidden_effect(const Folder& folder, const std::string& document) {
  const std::string bench = folder / "out/tutorial/bench";
  const json before = compared(folder, "base.toml", bench), by_hand = compared(folder, "by_hand.toml", bench),
             after = compared(folder, "better.toml", bench);
  for (const char* set : {"fitted", "holdout"}) {
    const double floor = figure(after.at(set), "floor_nrmse");
    fmt::print("{}: base {:.5f}, by hand {:.5f}, improved {:.5f}, floor {:.5f}\n", set,
               figure(before.at(set), "nrmse"), figure(by_hand.at(set), "nrmse"),
               figure(after.at(set), "nrmse"), floor);
    EXPECT_GT(figure(before.at(set), "nrmse"), 10.0 * floor) << "many times the noise floor";
    EXPECT_LT(figure(by_hand.at(set), "nrmse"), 0.5 * figure(before.at(set), "nrmse")) << "most of the error";
    EXPECT_GT(figure(by_hand.at(set), "nrmse"), 1.2 * floor) << "but not all";
    EXPECT_LT(figure(after.at(set), "nrmse"), 1.15 * floor) << "at the floor";
  }
  // "The flux explains most of the variation": more than any condition but time, which went with frequency.
  json flux;
  for (const json& condition : before.at("maps").at(0).at("conditions")) {
    if (condition.at("condition") == "psi_Wb") flux = condition;
  }
  EXPECT_GT(figure(flux, "share"), 0.6);
  EXPECT_EQ(flux.at("part"), "reactive") << "in quadrature to the voltage";
  EXPECT_LT(figure(flux, "p_value"), 0.02) << "fewer than one shuffle in fifty";
  for (const json& condition : before.at("maps").at(0).at("conditions")) {
    if (condition.at("share").is_null() || condition.at("condition") == "time_s") continue;
    EXPECT_LE(figure(condition, "share"), figure(flux, "share")) << condition.at("condition");
  }
  EXPECT_NE(document.find("missing: magnetizing_saturation"), std::string::npos);
  EXPECT_NE(document.find("the error has reached the noise floor"), std::string::npos);
}

void check_measured_motor(const Folder& folder, const std::string& document) {
  const std::string data = source("tests/data/motor_18k5");
  const json before = compared(folder, "motor.toml", data).at("records").at(0),
             after = compared(folder, "motor_better.toml", data).at("records").at(0);
  const auto error = [](const json& record, const char* channel) {
    return figure(record.at("channels").at(channel), "nrmse");
  };
  fmt::print("18.5 kW: shaft power {:.4f} before, {:.4f} after\n", error(before, "output_power_W"),
             error(after, "output_power_W"));
  EXPECT_LT(error(after, "output_power_W"), 0.35 * error(before, "output_power_W"));
  EXPECT_LT(error(after, "current_A"), 0.02);
  EXPECT_NE(document.find("missing: core_loss"), std::string::npos);
  EXPECT_NE(document.find("added core_loss"), std::string::npos);
}

TEST(Tutorial, DoesWhatItSays) {
  const Folder folder;
  lay_out(folder);
  const auto done = run({"bash", "-c",
                         fmt::format("cd '{}' && exec python3 '{}' document.md", folder.path(),
                                     source("scripts/lib/run_document.py"))},
                        kTimeout_s);
  ASSERT_EQ(done.exit_code, 0) << done.err << done.out;
  const std::string document = read_text(folder / "document.md");
  check_hidden_effect(folder, document);
  check_measured_motor(folder, document);
}

TEST(Tutorial, ShowsOutputsAndPicturesThatAreThere) {
  const std::string document = read_text(source("docs/missing-effect.md"));
  EXPECT_EQ(document.find("```text\n```"), std::string::npos) << "an output was never filled in";
  std::size_t pictures = 0;
  for (std::size_t at = document.find("](img/"); at != std::string::npos;
       at = document.find("](img/", at + 1), ++pictures) {
    const std::string path = document.substr(at + 2, document.find(')', at) - at - 2);
    EXPECT_TRUE(std::filesystem::exists(source("docs/" + path))) << path;
  }
  EXPECT_GE(pictures, 4u);
}

}  // namespace
}  // namespace imrig::test
