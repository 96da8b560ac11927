#include "estimators/model/model_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <bit>
#include <filesystem>
#include <random>

#include "rig/base/error.h"

namespace imrig::est {
namespace {

using testing::HasSubstr;

Model full_model() {
  Model m = nominal_model({});
  m.name = "bench \"3\", C:\\motor\nsecond line";
  m.delta = true;
  m.R_s = {0.39, 0.385, 0.396, "ohm", "dc test, 3 records"};
  m.R_s_stator_C = 25.125;
  m.history.push_back(
      {1, "identified, method auto", "quick campaign", 0xfedcba9876543210ull, 0.0123, kMissing, 1e-3});
  m.history.push_back({2, "refitted", "", 7, kMissing, 0.5, kMissing});
  return m;
}

std::string complaint_about(const std::string& text) {
  try {
    parse_model(text, "m.toml");
  } catch (const Error& e) {
    return e.what();
  }
  return "no complaint";
}

std::string with(const std::string& from, const std::string& to) {
  std::string text = to_toml(full_model());
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(ModelFileTest, EveryBitComesBack) {
  std::mt19937_64 random(11);
  for (int round = 0; round < 500; ++round) {
    Model m = full_model();
    for (const auto& base : base_parameters()) {
      Parameter& p = m.*base.place;
      p.value = std::ldexp(1.0 + static_cast<double>(random() >> 12) * 0x1p-52,
                           static_cast<int>(random() % 40) - 25);
      p.ci95_low = p.value - std::ldexp(static_cast<double>(random() >> 12) * 0x1p-52,
                                        static_cast<int>(random() % 40) - 30);
      p.ci95_high = p.value * (1.0 + static_cast<double>(random() >> 12) * 0x1p-52);
    }
    const Model back = parse_model(to_toml(m), "m.toml");
    for (const auto& base : base_parameters()) {
      EXPECT_EQ(std::bit_cast<std::uint64_t>((back.*base.place).value),
                std::bit_cast<std::uint64_t>((m.*base.place).value));
      EXPECT_EQ(std::bit_cast<std::uint64_t>((back.*base.place).ci95_low),
                std::bit_cast<std::uint64_t>((m.*base.place).ci95_low));
      EXPECT_EQ(std::bit_cast<std::uint64_t>((back.*base.place).ci95_high),
                std::bit_cast<std::uint64_t>((m.*base.place).ci95_high));
    }
    EXPECT_EQ(to_toml(back), to_toml(m));
  }
}

TEST(ModelFileTest, WordsAndHistoryComeBack) {
  const Model back = parse_model(to_toml(full_model()), "m.toml");
  EXPECT_EQ(back.name, full_model().name);
  EXPECT_TRUE(back.delta);
  EXPECT_EQ(back.R_s.found, "dc test, 3 records");
  EXPECT_EQ(back.R_s_stator_C, 25.125);
  ASSERT_EQ(back.history.size(), 2U);
  EXPECT_EQ(back.history[0].data_hash, 0xfedcba9876543210ull);
  EXPECT_EQ(back.history[0].fitted_nrmse, 0.0123);
  EXPECT_TRUE(std::isnan(back.history[0].holdout_nrmse));
  EXPECT_EQ(back.history[1].holdout_nrmse, 0.5);
}

TEST(ModelFileTest, SavesWholeFilesAndLoadsThem) {
  const auto path =
      std::filesystem::temp_directory_path() / ("imrig_model_" + std::to_string(::getpid()) + ".toml");
  save_model(full_model(), path);
  EXPECT_EQ(to_toml(load_model(path)), to_toml(full_model()));
  std::filesystem::remove(path);
  EXPECT_THROW(load_model(path), Error);
}

TEST(ModelFileTest, TheMotorOfThePaperIsShippedAndLoads) {
  const Model m = load_model(std::string(IMRIG_SOURCE_DIR) + "/models/motors/proca_keyhani_5hp.toml");
  EXPECT_EQ(m.machine().R_s, 0.39);
  EXPECT_EQ(m.machine().L_m, 0.068);
  EXPECT_EQ(m.pole_pairs, 2);
}

TEST(ModelFileTest, EveryShippedMotorLoads) {
  int count = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::string(IMRIG_SOURCE_DIR) + "/models/motors")) {
    if (entry.path().extension() != ".toml") continue;
    EXPECT_NO_THROW(load_model(entry.path().string())) << entry.path();
    ++count;
  }
  EXPECT_GE(count, 2);
}

TEST(ModelFileTest, AnUnknownKeyIsNamedWithItsLine) {
  EXPECT_THAT(complaint_about(with("pole_pairs = 2", "pole_pairs = 2\npolepairs = 2")),
              testing::AllOf(HasSubstr("m.toml:5"), HasSubstr("polepairs")));
  EXPECT_THAT(complaint_about(with("stator_C", "stator_K")), HasSubstr("stator_K"));
}

TEST(ModelFileTest, WhatDoesNotBelongIsRefused) {
  EXPECT_THAT(complaint_about(with("version = 1", "version = 2")), HasSubstr("version"));
  EXPECT_THAT(complaint_about(with("inverse-gamma", "T")), HasSubstr("circuit"));
  EXPECT_THAT(complaint_about(with("value = 0.39", "value = -0.39")), HasSubstr("value"));
  EXPECT_THAT(complaint_about(with("value = 0.39", "value = nan")), HasSubstr("value"));
  EXPECT_THAT(complaint_about(with("value = 0.39", "valeur = 0.39")), HasSubstr("value is missing"));
  EXPECT_THAT(complaint_about(with("ci95 = [0.385, 0.396]", "ci95 = [0.391, 0.396]")), HasSubstr("ci95"));
  EXPECT_THAT(complaint_about(with("unit = \"ohm\"", "unit = \"mohm\"")), HasSubstr("unit"));
  EXPECT_THAT(complaint_about(with("fedcba9876543210", "fedcba987654321z")), HasSubstr("data_hash"));
  EXPECT_THAT(complaint_about(with("pole_pairs = 2", "pole_pairs = 0")), HasSubstr("pole_pairs"));
  EXPECT_THAT(complaint_about("not toml at all ["), HasSubstr("TOML"));
  EXPECT_THAT(complaint_about(""), HasSubstr("version"));
}

TEST(ModelFileTest, AnEffectNobodyKnowsIsRefusedByName) {
  EXPECT_THAT(complaint_about(to_toml(full_model()) + "\n[[effect]]\nname = \"gremlins\"\n"),
              HasSubstr("gremlins"));
}

// A shape that the library had before reads where it bent nothing, and is refused where it did.
TEST(ModelFileTest, ARetiredShapeIsReadAtItsNeutralValueOnly) {
  const auto saturated = [](double settling) {
    return to_toml(full_model()) +
           "\n[[effect]]\nname = \"magnetizing_saturation\"\nform = \"power law\"\n"
           "[effect.parameters.extra]\nvalue = 0.5\nunit = \"1\"\nfound = \"fit\"\n"
           "[effect.parameters.settling]\nvalue = " +
           std::to_string(settling) + "\nunit = \"1\"\nfound = \"fit\"\n";
  };
  EXPECT_EQ(complaint_about(saturated(0.0)), "no complaint");
  EXPECT_THAT(complaint_about(saturated(1.5)), HasSubstr("settling"));
  EXPECT_THAT(complaint_about(saturated(1.5)), HasSubstr("model add"));
}

// At the ends of the split leakage saturates on one side only, where no search of the form goes.
TEST(ModelFileTest, ShapesHeldOutsideASearchsBoundsAreRead) {
  const std::string text = to_toml(full_model()) +
                           "\n[[effect]]\nname = \"leakage_saturation\"\nform = \"power law\"\n"
                           "[effect.parameters.rotor_share]\nvalue = 1.0\nunit = \"1\"\nfound = \"fit\"\n"
                           "[effect.parameters.bend]\nvalue = 0.0\nunit = \"1\"\nfound = \"fit\"\n";
  const Model model = parse_model(text, "m.toml");
  EXPECT_EQ(model.effects.at(0).parameters.at("rotor_share").value, 1.0);
  EXPECT_EQ(to_toml(parse_model(to_toml(model), "again.toml")), to_toml(model));
}

TEST(ModelTest, MachineOfAnIncompleteModelSaysWhatIsMissing) {
  Model m = full_model();
  m.L_l = {};
  try {
    m.machine();
    FAIL();
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), HasSubstr("L_l"));
  }
}

}  // namespace
}  // namespace imrig::est
