#include "rig/cli/improve_view.h"

#include <gtest/gtest.h>

#include <cmath>

#include "estimators/model/effects/registry.h"

namespace imrig {
namespace {

est::Candidate candidate(const std::string& effect, std::size_t form = 0) {
  return {*est::effect_number(effect), form};
}

// A step whose current model leaves chi2 of 1000 in 100 values.
est::SearchStep step_with(const std::string& effect, double expected, double refitted) {
  est::SearchStep step;
  step.base.chi2 = 1000.0;
  step.base.model.fit.values = 100;
  est::Score score;
  score.candidate = candidate(effect);
  score.lambda = expected;
  step.ranking.scores.push_back(score);
  est::Trial trial;
  trial.candidate = score.candidate;
  trial.sound = true;
  trial.chi2 = 1000.0 - refitted;
  step.trials.push_back(trial);
  step.claims.push_back(0);
  return step;
}

TEST(Overview, TellsExpectedAndRefittedGain) {
  const auto rows = overview(step_with("core_loss", 450.0, 430.0));
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].effect, "core_loss");
  EXPECT_DOUBLE_EQ(rows[0].expected_gain, 450.0);
  EXPECT_DOUBLE_EQ(rows[0].expected_share, 0.5) << "noise explains 100 of the 1000";
  EXPECT_DOUBLE_EQ(rows[0].gain, 430.0);
  EXPECT_EQ(rows[0].warning, "");
}

TEST(Overview, WarnsWhereForecastAndRefitDisagree) {
  EXPECT_NE(overview(step_with("core_loss", 450.0, 30.0))[0].warning.find("less"), std::string::npos);
  EXPECT_NE(overview(step_with("core_loss", 100.0, 800.0))[0].warning.find("more"), std::string::npos);
  EXPECT_EQ(overview(step_with("core_loss", 4.0, 1.0))[0].warning, "") << "that is noise";
}

TEST(Overview, SaysWhenARefitIsOfNoUse) {
  est::SearchStep step = step_with("core_loss", 450.0, 430.0);
  step.trials[0].sound = false;
  step.trials[0].unsound = "it sits on a bound";
  EXPECT_NE(overview(step)[0].warning.find("it sits on a bound"), std::string::npos);
}

TEST(Overview, HasOneRowAnEffectAndNoGainWithoutARefit) {
  est::SearchStep step = step_with("core_loss", 450.0, 430.0);
  step.ranking.scores.push_back(step.ranking.scores[0]);
  est::Score other;
  other.candidate = candidate("rotor_heating");
  other.lambda = 1.0;
  step.ranking.scores.push_back(other);
  const auto rows = overview(step);
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[1].effect, "rotor_heating");
  EXPECT_TRUE(std::isnan(rows[1].gain));
}

TEST(WaterfallNotes, TellOfASensorErrorThatACorrectionHadFollowed) {
  est::Search search;
  search.steps.push_back(step_with("current_gain", 50.0, 40.0));
  const std::size_t effect = *est::effect_number("current_gain");
  search.steps[0].base.model.nuisances.push_back(est::kSharedPlace[effect]);
  const auto notes = waterfall_notes(search);
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_NE(notes[0].find("current_gain"), std::string::npos);
  EXPECT_NE(notes[0].find("correction"), std::string::npos);
}

TEST(WaterfallNotes, AreSilentAboutStepsThatShow) {
  est::Search search;
  search.steps.push_back(step_with("core_loss", 800.0, 850.0));
  EXPECT_TRUE(waterfall_notes(search).empty());
  search.steps[0] = step_with("core_loss", 20.0, 18.0);
  EXPECT_EQ(waterfall_notes(search).size(), 1u) << "two per cent of chi2 is no step to see";
}

TEST(WaterfallNotes, NameACorrectionThatLiesOutsideItsAccuracy) {
  est::Search search;
  const std::size_t entry = est::kSharedPlace[*est::effect_number("current_gain")];
  search.final.model.nuisances.push_back(entry);
  search.final.model.priors.push_back({entry, 0.0, 0.002});
  search.final.model.at.shared[entry] = 0.003;
  EXPECT_TRUE(waterfall_notes(search).empty()) << "that may be";
  search.final.model.at.shared[entry] = -0.006;
  ASSERT_EQ(waterfall_notes(search).size(), 1u);
  EXPECT_NE(waterfall_notes(search)[0].find("3 times its accuracy"), std::string::npos)
      << waterfall_notes(search)[0];
}

TEST(Ending, DoesNotCallTheFloorAProofWhereTheDataShowNothing) {
  est::Diagnosis d;
  d.search.at_floor = true;
  d.search.changes.resize(1);
  EXPECT_NE(ending(d).find("at the noise floor already"), std::string::npos);
  d.verdict = "cannot_tell";
  EXPECT_NE(ending(d).find("no proof"), std::string::npos);
}

TEST(SideBySide, MarksWhatMovedWhatIsNewAndWhatIsGone) {
  est::Model before;
  before.R_s = {0.4, 0.39, 0.41, "ohm", ""};
  before.R_r = {0.2, 0.19, 0.21, "ohm", ""};
  before.L_l = {0.006, kMissing, kMissing, "H", ""};
  before.L_m = {0.07, 0.069, 0.071, "H", ""};
  before.effects.push_back({"core_loss", "", {{"eddy_S", {0.001, kMissing, kMissing, "S", ""}}}});
  est::Model after = before;
  after.R_s.value = 0.405;
  after.R_r.value = 0.25;
  after.effects = {{"rotor_skin_effect", "line", {{"k6_ohm_s", {0.001, kMissing, kMissing, "ohm s", ""}}}}};
  std::map<std::string, ModelRow> rows;
  for (const auto& row : side_by_side(before, after)) rows[row.name] = row;
  EXPECT_EQ(rows.at("R_s").mark, "");
  EXPECT_EQ(rows.at("R_r").mark, "moved");
  EXPECT_NEAR(rows.at("R_r").change_percent, 25.0, 1e-9);
  EXPECT_EQ(rows.at("L_l").mark, "") << "it had no interval to leave";
  EXPECT_EQ(rows.at("rotor_skin_effect.k6_ohm_s").mark, "new");
  EXPECT_EQ(rows.at("core_loss.eddy_S").mark, "gone");
}

TEST(Waterfall, StandsOverWhatNoiseLeaves) {
  est::Search search;
  est::SearchChange change;
  change.text = "as it came";
  change.fitted.error2 = 4.0, change.fitted.signal2 = 100.0, change.fitted.noise2 = 1.0;
  change.fitted.chi2 = 400.0, change.fitted.values = 100.0;
  search.changes.push_back(change);
  const auto falls = waterfall(search);
  ASSERT_EQ(falls.size(), 1u);
  EXPECT_DOUBLE_EQ(falls[0].fitted, 0.2);
  EXPECT_DOUBLE_EQ(falls[0].floor, 0.1);
  EXPECT_DOUBLE_EQ(falls[0].fitted_over_noise, 2.0);
  EXPECT_TRUE(std::isnan(falls[0].holdout)) << "nothing was held out";
}

}  // namespace
}  // namespace imrig
