#include "rig/campaign/plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "rig/base/error.h"

namespace imrig {
namespace {

using ::testing::HasSubstr;

const std::string kHead = "version = 1\nname = \"p\"\n";

std::string complaint(const std::string& text) {
  try {
    parse_plan(text, "p.toml");
  } catch (const Error& e) {
    return e.what();
  }
  return "no complaint";
}

const PlanPoint& find(const Plan& plan, const std::string& id) {
  const auto found =
      std::find_if(plan.points.begin(), plan.points.end(), [&](const PlanPoint& p) { return p.id == id; });
  if (found == plan.points.end()) throw std::out_of_range(id);
  return *found;
}

TEST(Plan, EveryShippedPlanLoads) {
  int plans = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::string(IMRIG_SOURCE_DIR) + "/campaigns")) {
    const Plan plan = load_plan(entry.path().string());
    EXPECT_FALSE(plan.points.empty()) << entry.path();
    EXPECT_EQ(plan.name + ".toml", entry.path().filename().string());
    EXPECT_NE(plan.hash, 0u);
    ++plans;
  }
  EXPECT_GE(plans, 4);
}

TEST(Plan, PaperGridIsSixFrequenciesTenVoltagesEightLoads) {
  const Plan plan = load_plan(std::string(IMRIG_SOURCE_DIR) + "/campaigns/proca_grid.toml");
  const auto steps = std::count_if(plan.points.begin(), plan.points.end(),
                                   [](const auto& p) { return p.kind == PointKind::kStep; });
  EXPECT_EQ(steps, 6 * 10 * 8);
  const PlanPoint& corner = find(plan, "f80_v100_l7");
  EXPECT_EQ(corner.frequency_Hz, 80);
  EXPECT_EQ(corner.voltage_percent, 100);
  EXPECT_EQ(corner.load.share, 1.0);
  EXPECT_EQ(corner.step, 0.1);
  EXPECT_EQ(find(plan, "f30_v10_l0").load.share, 0.0);
}

TEST(Plan, StandstillDefaultsAreThePublishedReference) {
  const Plan plan = parse_plan(kHead + "[standstill]\n", "p");
  const PlanPoint& p = find(plan, "standstill");
  EXPECT_THAT(p.tones.amplitude_A, ::testing::ElementsAre(3, 4, 6));
  ASSERT_EQ(p.tones.frequency_Hz.size(), 3u);
  EXPECT_NEAR(p.tones.frequency_Hz[2], 70 / 6.283185307, 1e-9);
  EXPECT_EQ(p.tones.kp_V_per_A, 1.6);
  EXPECT_EQ(p.tones.ki_V_per_As, 116);
}

TEST(Plan, LoadsMayBeACountSharesOrTorques) {
  const std::string grid = "[grid]\nfrequencies_Hz = [50]\nvoltages_percent = [80]\n";
  EXPECT_EQ(parse_plan(kHead + grid, "p").points.size(), 1u);
  const Plan count = parse_plan(kHead + grid + "loads = 3\n", "p");
  EXPECT_EQ(find(count, "f50_v80_l1").load.share, 0.5);
  const Plan shares = parse_plan(kHead + grid + "loads_share = [0.25]\n", "p");
  EXPECT_EQ(find(shares, "f50_v80_l0").load.share, 0.25);
  const Plan torques = parse_plan(kHead + grid + "loads_Nm = [0, 7.5]\n", "p");
  EXPECT_EQ(find(torques, "f50_v80_l1").load.torque_Nm, 7.5);
}

TEST(Plan, ALockedSweepTakesEachFrequencyAtEachCurrent) {
  const std::string sweep = "[locked_sweep]\nfrequencies_Hz = [5, 20]\n";
  const Plan plan = parse_plan(kHead + sweep + "currents_A = [2, 7.5]\nregulated = true\n", "p");
  ASSERT_EQ(plan.points.size(), 4u);
  const PlanPoint& p = find(plan, "locked_f20_i7p5");
  EXPECT_EQ(p.level_A, 7.5);
  EXPECT_THAT(p.tones.amplitude_A, ::testing::ElementsAre(7.5));
  EXPECT_THAT(p.tones.frequency_Hz, ::testing::ElementsAre(20));
  EXPECT_EQ(find(parse_plan(kHead + sweep + "currents_A = [2]\n", "p"), "locked_f5").level_A, 2.0);
  EXPECT_THAT(complaint(kHead + sweep + "currents_A = [2]\ncurrent_A = 2\n"), HasSubstr("stands beside"));
}

TEST(Plan, RepeatsNameTheirFirst) {
  const Plan plan =
      parse_plan(kHead + "repeats = 3\n[no_load]\nfrequencies_Hz = [50]\nvoltages_percent = [100]\n", "p");
  ASSERT_EQ(plan.points.size(), 3u);
  EXPECT_EQ(plan.points[0].repeat_of, "");
  EXPECT_EQ(plan.points[2].id, "no_load_f50_v100_r3");
  EXPECT_EQ(plan.points[2].repeat_of, "no_load_f50_v100");
}

TEST(Plan, HoldoutByFractionIsStableAndTakesStepsAlone) {
  const std::string text =
      kHead +
      "holdout_fraction = 0.25\n[dc]\nlevels_A = [5]\n[grid]\nfrequencies_Hz = [30, 40]\n"
      "voltages_percent = [50, 100]\nloads = 4\n";
  const Plan plan = parse_plan(text, "p");
  const Plan again = parse_plan(text, "p");
  int held = 0;
  for (std::size_t k = 0; k < plan.points.size(); ++k) {
    EXPECT_EQ(plan.points[k].holdout, again.points[k].holdout);
    held += plan.points[k].holdout ? 1 : 0;
  }
  EXPECT_EQ(held, 4);
  EXPECT_FALSE(find(plan, "dc_5A").holdout);
}

TEST(Plan, HoldoutByNameTakesRepeatsAlong) {
  const Plan plan = parse_plan(kHead + "repeats = 2\nholdout = [\"dc_5A\"]\n[dc]\nlevels_A = [5, 6]\n", "p");
  EXPECT_TRUE(find(plan, "dc_5A").holdout);
  EXPECT_TRUE(find(plan, "dc_5A_r2").holdout);
  EXPECT_FALSE(find(plan, "dc_6A").holdout);
}

TEST(Plan, ExplicitPointsOfEveryKind) {
  const Plan plan =
      parse_plan(kHead +
                     "[[point]]\nfrequency_Hz = 32.5\nvoltage_percent = 60\nload_Nm = 4\n"
                     "[[point]]\nkind = \"steady\"\nid = \"mine\"\nfrequency_Hz = 50\nvoltage_percent = "
                     "60\nload_share = 0.5\nholdout = true\n"
                     "[[point]]\nkind = \"startup\"\nfrequency_Hz = 30\nvoltage_percent = 20\nramp_s = 0.5\n"
                     "[[point]]\nkind = \"coast_down\"\nfrequency_Hz = 60\nvoltage_percent = 100\n",
                 "p");
  EXPECT_EQ(find(plan, "f32p5_v60_l4Nm").load.torque_Nm, 4);
  EXPECT_TRUE(find(plan, "mine").holdout);
  EXPECT_EQ(find(plan, "startup_f30_v20").ramp_s, 0.5);
  EXPECT_EQ(find(plan, "coast_down_f60_v100").kind, PointKind::kCoastDown);
}

struct Bad {
  const char* text;
  const char* says;
};

class BadPlan : public ::testing::TestWithParam<Bad> {};

TEST_P(BadPlan, IsToldInOneSentenceThatNamesTheKey) {
  const std::string what = complaint(GetParam().text);
  EXPECT_THAT(what, HasSubstr(GetParam().says));
  EXPECT_THAT(what, HasSubstr("p.toml"));
  EXPECT_EQ(what.find('\n'), std::string::npos) << what;
}

INSTANTIATE_TEST_SUITE_P(
    All, BadPlan,
    ::testing::Values(
        Bad{"", "version"}, Bad{"version = [", "p.toml"},
        Bad{"version = 2\nname = \"p\"\n[dc]\nlevels_A = [1]\n", "version"},
        Bad{"version = 1\n[dc]\nlevels_A = [1]\n", "name"},
        Bad{"version = 1\nname = \"\"\n[dc]\nlevels_A = [1]\n", "name"},
        Bad{"version = 1\nname = \"p\"\n", "holds no point"},
        Bad{"version = 1\nname = \"p\"\nodd = 1\n[dc]\nlevels_A = [1]\n", "odd"},
        Bad{"version = 1\nname = \"p\"\n[dc]\nlevels_A = []\n", "levels_A"},
        Bad{"version = 1\nname = \"p\"\n[dc]\nlevels_A = [-1]\n", "levels_A"},
        Bad{"version = 1\nname = \"p\"\n[dc]\nlevels_A = [1]\nlevel = 2\n", "level"},
        Bad{"version = 1\nname = \"p\"\n[dc]\nlevels_A = [1, 1]\n", "dc_1A"},
        Bad{"version = 1\nname = \"p\"\n[dc]\nlevels_A = [1]\nrecord_s = 0\n", "record_s"},
        Bad{"version = 1\nname = \"p\"\n[grid]\nvoltages_percent = [50]\n", "frequencies_Hz"},
        Bad{"version = 1\nname = \"p\"\n[grid]\nfrequencies_Hz = [0]\nvoltages_percent = [50]\n",
            "frequencies_Hz"},
        Bad{"version = 1\nname = \"p\"\n[grid]\nfrequencies_Hz = [nan]\nvoltages_percent = [50]\n",
            "frequencies_Hz"},
        Bad{"version = 1\nname = \"p\"\n[grid]\nfrequencies_Hz = [50]\nvoltages_percent = [50]\nloads = 0\n",
            "loads"},
        Bad{"version = 1\nname = \"p\"\n[grid]\nfrequencies_Hz = [50]\nvoltages_percent = [50]\nloads = "
            "2\nloads_Nm = [1]\n",
            "loads"},
        Bad{"version = 1\nname = \"p\"\n[grid]\nfrequencies_Hz = [50]\nvoltages_percent = [50]\nloads_share "
            "= [1.5]\n",
            "loads_share"},
        Bad{"version = 1\nname = \"p\"\n[grid]\nfrequencies_Hz = [50]\nvoltages_percent = [50]\nstep_percent "
            "= 0\n",
            "step_percent"},
        Bad{"version = 1\nname = \"p\"\n[grid]\nfrequencies_Hz = [50]\nvoltages_percent = [50]\nsettle_s = "
            "2\nsettle_bound_s = 1\n",
            "settle_bound_s"},
        Bad{"version = 1\nname = \"p\"\n[standstill]\ntones_A = [1, 2]\ntones_rad_s = [1]\n", "tones_A"},
        Bad{"version = 1\nname = \"p\"\n[standstill]\ntones_A = [1, 2]\n", "tones_rad_s"},
        Bad{"version = 1\nname = \"p\"\n[[point]]\nkind = \"jump\"\nfrequency_Hz = 5\nvoltage_percent = 5\n",
            "jump"},
        Bad{"version = 1\nname = \"p\"\n[[point]]\nid = \"a/b\"\nfrequency_Hz = 5\nvoltage_percent = 5\n",
            "a/b"},
        Bad{"version = 1\nname = \"p\"\n[[point]]\nfrequency_Hz = 5\nvoltage_percent = 5\nload_Nm = "
            "1\nload_share = 1\n",
            "load_share"},
        Bad{"version = 1\nname = \"p\"\nholdout = [\"none\"]\n[dc]\nlevels_A = [1]\n", "none"},
        Bad{"version = 1\nname = \"p\"\nholdout = [\"dc_1A\"]\nholdout_fraction = 0.1\n[dc]\nlevels_A = "
            "[1]\n",
            "holdout_fraction"},
        Bad{"version = 1\nname = \"p\"\nrepeats = 0\n[dc]\nlevels_A = [1]\n", "repeats"},
        Bad{"version = 1\nname = \"p\"\n[limits]\npull_out_margin = 1.5\n[dc]\nlevels_A = [1]\n",
            "pull_out_margin"},
        Bad{"version = 1\nname = \"p\"\n[motion]\nunload = 1\n[dc]\nlevels_A = [1]\n", "unload"},
        Bad{"version = 1\nname = \"p\"\nrepeats = 100\n[grid]\nfrequencies_Hz = "
            "[10,20,30,40,50,60,70,80]\nvoltages_percent = "
            "[10,20,30,40,50,60,70,80,90,100]\nloads = 100\n",
            "20000"}));

TEST(Plan, MissingFileIsSaid) { EXPECT_THROW(load_plan("/nonexistent/plan.toml"), Error); }

}  // namespace
}  // namespace imrig
