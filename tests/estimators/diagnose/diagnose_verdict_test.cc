// What diagnose says of data whose flaw is known. Records come from an independent simulation (synthetic.h);
// the flaws are put into them by hand, or into the motor that makes them.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>

#include "estimators/diagnose/diagnose_json.h"
#include "rig/base/error.h"
#include "rig/base/space_vector.h"
#include "tests/estimators/diagnose/flawed_grid.h"

namespace imrig::est {
namespace {

TEST(Diagnose, FindsNothingInMotorsThatLackNothing) {
  for (std::size_t k = 0; k < synthetic::motors().size(); ++k) {
    const auto& motor = synthetic::motors()[k];
    const Diagnosis d = diagnose(model_of(motor), grid(motor, 100 * (k + 1)));
    EXPECT_EQ(d.verdict, "adequate") << motor.name << ": " << d.effect;
    EXPECT_TRUE(d.effect.empty());
    EXPECT_EQ(d.ranked_among, 16u);
  }
}

struct Case {
  const char* effect;
  Flaw flaw;
};

TEST(Diagnose, NamesEachFlawOfTheSensors) {
  const auto& motor = synthetic::motors()[1];
  const std::vector<Case> cases{{"current_offset",
                                 [](Record& r) {
                                   for (auto& i : r.series.i) i += SpaceVector(0.3, -0.2);
                                 }},
                                {"current_gain",
                                 [](Record& r) {
                                   for (auto& i : r.series.i) i += 0.01 * std::conj(i);
                                 }},
                                {"supply_unbalance",
                                 [](Record& r) {
                                   for (auto& v : r.series.v) v += 0.01 * std::conj(v);
                                 }},
                                {"voltage_lag", [](Record& r) {
                                   const auto v = r.series.v;
                                   for (std::size_t k = 1; k < v.size(); ++k)
                                     r.series.v[k] = 0.7 * v[k] + 0.3 * v[k - 1];  // 60 us of 200
                                 }}};
  for (const Case& c : cases) {
    const Diagnosis d = diagnose(model_of(motor), grid(motor, 7, c.flaw));
    EXPECT_EQ(d.effect, c.effect) << d.verdict;
    EXPECT_EQ(d.verdict, "missing") << c.effect;
  }
}

TEST(Diagnose, NamesNothingElseWhereWhatIsThereIsRuledOut) {
  const auto& motor = synthetic::motors()[1];
  const DataSet data = grid(motor, 7, {}, [&](std::size_t n) {
    synthetic::Motor m = motor;
    m.R_r *= 1.0 + 0.25 * static_cast<double>((n * 7) % 18) / 18.0;
    return m;
  });
  DiagnoseOptions options;
  options.without = {"rotor_heating"};
  const Diagnosis d = diagnose(model_of(motor), data, options);
  EXPECT_EQ(d.verdict, "unknown") << d.effect;
  EXPECT_EQ(d.ranked_among, 15u);
  options.without = {"no_such_effect"};
  EXPECT_THROW(diagnose(model_of(motor), data, options), Error);
}

// One current sensor that reads 1 % too much makes every impedance 0.33 % too small, which no fit can see.
TEST(Diagnose, WhereChannelsDoNotMatchTheIntervalsHoldWhatTheirMeanMayBe) {
  const auto& motor = synthetic::motors()[1];
  const Model truth = model_of(motor);
  DataSet data = grid(motor, 7, [](Record& r) {
    for (auto& i : r.series.i) {
      auto phase = phases(i);
      phase[0] *= 1.01;
      i = space_vector(phase[0], phase[1], phase[2]);
    }
  });
  data.accuracy = {0.001, 0.001};
  const Improvement found = improve(truth, data);
  EXPECT_EQ(found.diagnosis.effect, "current_gain");
  for (const auto p : {&Model::R_r, &Model::L_l, &Model::L_m}) {
    const Parameter& seen = found.model.*p;
    EXPECT_LT(seen.ci95_low, (truth.*p).value);
    EXPECT_GT(seen.ci95_high, (truth.*p).value);
    EXPECT_LT(seen.ci95_high - seen.ci95_low, 0.02 * seen.value);
  }
}

TEST(Diagnose, ASpeedThatIsOffIsNamedOrStandsBesideItsTwin) {
  const auto& motor = synthetic::motors()[1];
  const Diagnosis d = diagnose(model_of(motor), grid(motor, 7, [](Record& r) {
                                 for (auto& w : r.series.speed_rad_s) w *= 1.003;
                               }));
  ASSERT_FALSE(d.confusable.empty()) << d.verdict;
  EXPECT_NE(std::find(d.confusable.begin(), d.confusable.end(), "speed_bias"), d.confusable.end())
      << d.effect;
}

TEST(Diagnose, ARotorThatIsWarmerInSomeRecordsIsNamedWithAndWithoutATemperature) {
  const auto& motor = synthetic::motors()[1];
  const auto warmth = [](std::size_t n) { return 1.0 + 0.25 * static_cast<double>((n * 7) % 18) / 18.0; };
  const auto warmer = [&](std::size_t n) {
    synthetic::Motor m = motor;
    m.R_r *= warmth(n);
    return m;
  };
  const Diagnosis blind = diagnose(model_of(motor), grid(motor, 7, {}, warmer));
  EXPECT_EQ(blind.effect, "rotor_heating") << blind.verdict;
  std::size_t n = 0;
  const Diagnosis seen = diagnose(
      model_of(motor), grid(
                           motor, 7,
                           [&](Record& r) {
                             // 0.4 % a kelvin from 30 degrees Celsius
                             r.series.stator_C.assign(r.series.size(), 30.0 + (warmth(n++) - 1.0) / 0.004);
                           },
                           warmer));
  EXPECT_EQ(seen.effect, "rotor_heating");
  EXPECT_EQ(seen.verdict, "missing");
  const auto& estimate = seen.candidates.front().estimate;
  ASSERT_TRUE(estimate.contains("per_K"));
  // R_r = R_30 (1 + 0.004 (T - 30)), told relative to the mean temperature's R_r.
  EXPECT_NEAR(estimate.at("per_K").value, 0.004 / 1.118, 0.04 * 0.0036);
}

TEST(Diagnose, NamesAndOrderOfTheRecordsDoNotMatter) {
  const auto& motor = synthetic::motors()[1];
  DataSet data = grid(motor, 7, [](Record& r) {
    for (auto& i : r.series.i) i += 0.01 * std::conj(i);
  });
  const Diagnosis first = diagnose(model_of(motor), data);
  std::reverse(data.records.begin(), data.records.end());
  for (std::size_t k = 0; k < data.records.size(); ++k) {
    data.records[k].id = fmt::format("record {}", k);
    data.records[k].kind = RecordKind::kFree;
    data.records[k].set = {};
  }
  data.name = "x";
  const Diagnosis again = diagnose(model_of(motor), data);
  EXPECT_EQ(first.verdict, again.verdict);
  EXPECT_EQ(first.effect, again.effect);
  ASSERT_FALSE(first.candidates.front().estimate.empty());
  for (const auto& [name, p] : first.candidates.front().estimate)
    EXPECT_NEAR(p.value, again.candidates.front().estimate.at(name).value, 1e-3 * std::abs(p.value) + 1e-6)
        << name;
}

TEST(Improve, BringsTheErrorToTheFloorAndKeepsItsHistory) {
  const auto& motor = synthetic::motors()[1];
  const DataSet data = grid(motor, 7, [](Record& r) {
    for (auto& i : r.series.i) i += 0.02 * std::conj(i) + SpaceVector(0.4, 0.0);
  });
  const Improvement improved = improve(model_of(motor), data);
  std::vector<std::string> names;
  for (const auto& effect : improved.model.effects) names.push_back(effect.name);
  std::sort(names.begin(), names.end());
  EXPECT_EQ(names, (std::vector<std::string>{"current_gain", "current_offset"}));
  EXPECT_TRUE(improved.diagnosis.search.at_floor);
  const auto& last = improved.diagnosis.search.changes.back();
  EXPECT_LT(last.holdout.nrmse(), 1.05 * last.holdout.floor());
  EXPECT_EQ(improved.model.history.size(), improved.diagnosis.search.changes.size());
  const auto json = nlohmann::json::parse(improve_json(improved, "m2.toml"));
  EXPECT_EQ(json["model"], "m2.toml");
  EXPECT_EQ(json["steps"].size(), improved.diagnosis.search.changes.size());
  for (const char* key : {"effect", "fitted_nrmse", "holdout_nrmse", "floor_nrmse"})
    EXPECT_TRUE(json["steps"][0].contains(key)) << key;
}

TEST(DiagnoseJson, HoldsEveryKeyThatOtherProgramsRelyOn) {
  const auto& motor = synthetic::motors()[1];
  const Diagnosis d = diagnose(model_of(motor), grid(motor, 7, [](Record& r) {
                                 for (auto& i : r.series.i) i += 0.02 * std::conj(i);
                               }));
  const auto json = nlohmann::json::parse(diagnose_json(d));
  for (const char* key :
       {"verdict", "effect", "confusable", "ranked_among", "candidates", "unexplained", "next_experiment"})
    EXPECT_TRUE(json.contains(key)) << key;
  for (const char* key : {"effect", "verdict", "score", "p_value", "estimate", "holdout_nrmse_before",
                          "holdout_nrmse_after", "distinguishability"})
    EXPECT_TRUE(json["candidates"][0].contains(key)) << key;
  const auto& estimate = json["candidates"][0]["estimate"]["phase_a"];
  for (const char* key : {"value", "ci95", "unit"}) EXPECT_TRUE(estimate.contains(key)) << key;
}

TEST(Diagnose, RefusesAModelOfAnotherMotor) {
  Model model = model_of(synthetic::motors()[1]);
  model.pole_pairs = 7;
  EXPECT_ANY_THROW(diagnose(model, grid(synthetic::motors()[1], 1)));
}

}  // namespace
}  // namespace imrig::est
