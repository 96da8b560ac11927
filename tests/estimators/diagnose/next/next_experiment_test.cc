// The experiment that is chosen where the physics says which one it must be.

#include "estimators/diagnose/next/next_experiment.h"

#include <gtest/gtest.h>

#include <cmath>

#include "estimators/diagnose/next/separation.h"
#include "tests/estimators/diagnose/next/doubt.h"

namespace imrig::est::test {
namespace {

// Slip and heat rise together, so a resistance that rises with one rises with the other.
std::vector<Taken> loaded_and_warm() {
  std::vector<Taken> list;
  for (const double f : {0.5, 0.8, 1.0}) {
    for (const double slip : {0.1, 0.5, 1.0, 1.4})
      list.push_back({0.9 * f, f, slip, 1.0, 1.0 + 0.004 * slip, 30.0 + 25.0 * slip});
  }
  return list;
}

TEST(NextExperiment, TellsRotorHeatingFromSkinEffectByALockedFrequencySweep) {
  const DataSet data = data_of(loaded_and_warm(), 11);
  const Model model = model_of(bench_motor());
  const GlobalProblem problem(data, model.machine(), 2);
  const SearchStep step =
      doubt(problem, model, {form_of_effect("rotor_heating"), form_of_effect("rotor_skin_effect")});
  ASSERT_EQ(step.confusable.size(), 2u);
  const auto next = separating_experiment(problem, doubt_of(step), range_of(problem, model));
  ASSERT_TRUE(next.has_value());
  EXPECT_EQ(next->kind, "locked_sweep") << next->what;
  EXPECT_NE(next->what.find("frequency sweep"), std::string::npos) << next->what;
  EXPECT_GT(next->distinguishability_after, next->distinguishability_before);
  EXPECT_GT(next->distinguishability_after, kConfusable);
}

// A lost voltage is a resistance that falls with current, so it looks like a winding that is warm where the
// current is small.
TEST(NextExperiment, TellsStatorHeatingFromDeadTimeBySeveralCurrents) {
  std::vector<Taken> list;
  for (const double slip : {0.4, 0.6, 0.8, 1.0, 1.3, 1.6}) list.push_back({0.3, 0.3, slip});
  const auto current = [](const Record& r) { return std::abs(r.series.i.back()); };
  const DataSet cold = data_of(list, 12);
  const double least = current(cold.records.front());
  for (std::size_t k = 0; k < list.size(); ++k) {
    const double part = least / current(cold.records[k]);
    list[k].R_s = 1.0 + 0.05 * part;
    list[k].stator_C = 30.0 + 40.0 * part;
  }
  const DataSet data = data_of(list, 12);
  const Model model = model_of(bench_motor());
  const GlobalProblem problem(data, model.machine(), 2);
  const SearchStep step =
      doubt(problem, model, {form_of_effect("stator_heating"), form_of_effect("inverter_dead_time")});
  const auto next = separating_experiment(problem, doubt_of(step), range_of(problem, model));
  ASSERT_TRUE(next.has_value());
  EXPECT_EQ(next->kind, "locked_sweep") << next->what;
  EXPECT_NE(next->what.find("current sweep"), std::string::npos) << next->what;
  EXPECT_GT(next->distinguishability_after, next->distinguishability_before);
}

// Iron that takes its eddy currents at the rotor flux slips a little more: j w_r G R_r psi_r is what a speed
// that is off by the factor G R_r makes, at any voltage, frequency and load.
TEST(NextExperiment, FindsThatNoRecordTellsASpeedErrorFromEddyCurrentsAtTheRotorFlux) {
  std::vector<Taken> list;
  for (const double f : {0.4, 0.7, 1.0}) {
    for (const double slip : {0.1, 0.5, 1.0}) list.push_back({0.9 * f, f, slip});
  }
  DataSet data = data_of(list, 13);
  for (Record& r : data.records) {
    for (double& w : r.series.speed_rad_s) w *= 1.004;
  }
  const Model model = model_of(bench_motor());
  const GlobalProblem problem(data, model.machine(), 2);
  SearchStep step = doubt(problem, model, {form_of_effect("speed_bias"), form_of_effect("core_loss")});
  const auto next = separating_experiment(problem, doubt_of(step), range_of(problem, model));
  ASSERT_TRUE(next.has_value());
  EXPECT_EQ(next->kind, "reference");
  EXPECT_TRUE(next->toml.empty());
  EXPECT_TRUE(std::isnan(next->distinguishability_after));
  EXPECT_NE(next->what.find("second speed reference"), std::string::npos);
}

// d on the data at hand is that of the score test, sqrt(lambda) sin(theta/2), where effects are weak.
TEST(Separation, AgreesWithTheScoreTestOnWeakEffects) {
  const DataSet data = data_of(loaded_and_warm(), 14);
  const Model model = model_of(bench_motor());
  const GlobalProblem problem(data, model.machine(), 2);
  const SearchStep step =
      doubt(problem, model, {form_of_effect("rotor_heating"), form_of_effect("rotor_skin_effect")});
  const Separation all(problem, step.base.model, {&step.trials[0].model, &step.trials[1].model}, {});
  ASSERT_EQ(all.now().size(), 2u);
  for (const Apart& p : all.now()) {
    const double lambda = 2.0 * std::sin(0.5 * std::acos(p.cosine())) * 0.5 * std::sqrt(p.whole);
    EXPECT_NEAR(p.d(), lambda, 0.02 * lambda);
    EXPECT_NEAR(p.cosine(), step.ranking.cosine(0, 1), 0.01);
    EXPECT_NEAR(std::sqrt(p.whole), std::sqrt(step.ranking.scores[0].lambda), 2.5);
  }
}

// The linearised forecast of what an experiment brings against whole refits.
TEST(Separation, ByOneLinearStepIsThatOfRefitsForWeakEffects) {
  const DataSet data = data_of(loaded_and_warm(), 15);
  const Model model = model_of(bench_motor());
  const GlobalProblem problem(data, model.machine(), 2);
  const SearchStep step =
      doubt(problem, model, {form_of_effect("rotor_heating"), form_of_effect("rotor_skin_effect")});
  const MachineParameters<double> motor = model.machine();
  const auto experiments = menu(range_of(problem, model), motor, 2);
  const Separation all(problem, step.base.model, {&step.trials[0].model, &step.trials[1].model}, experiments);
  for (std::size_t e = 0; e < all.experiments(); ++e) {
    const auto whole = all.refitted(e);
    for (std::size_t k = 0; k < whole.size(); ++k) {
      EXPECT_NEAR(all.with(e)[k].d(), whole[k].d(), 0.03 * whole[k].d()) << experiments[e].name;
      EXPECT_GE(whole[k].d(), 0.97 * all.now()[k].d());  // more records never make it harder
    }
  }
}

// Records near one slip say nothing of what goes with the slip's frequency.
TEST(NextExperiment, ShowsSkinEffectWherePoorDataCannot) {
  const DataSet data = data_of({{0.5, 0.5, 0.2}, {0.5, 0.5, 0.25}, {0.52, 0.5, 0.2}, {0.52, 0.5, 0.25}}, 16);
  const Model model = model_of(bench_motor());
  const GlobalProblem problem(data, model.machine(), 2);
  const SearchStep step = doubt(problem, model, {form_of_effect("core_loss")});
  RigRange range = range_of(problem, model);
  range.current_A = 30.0, range.voltage_V = 200.0, range.speed_rad_s = 250.0;
  const auto next = revealing_experiment(problem, step, {*effect_number("rotor_skin_effect")}, range);
  ASSERT_TRUE(next.has_value());
  EXPECT_NE(next->what.find("locked-like frequency sweep at low current"), std::string::npos) << next->what;
  EXPECT_LT(next->distinguishability_before, 0.2);
  EXPECT_GT(next->distinguishability_after, 2.0);
}

}  // namespace
}  // namespace imrig::est::test
