// The motor from all records together, where no record alone tells it: steady records, tables, and what is
// said where the data leave a parameter open.
#include "estimators/fit/global/start_from_data.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "estimators/fit/global/rough_circuits.h"
#include "estimators/fit/identify.h"
#include "estimators/fit/identify_json.h"
#include "estimators/model/convert.h"
#include "estimators/model/model_file.h"
#include "rig/base/error.h"
#include "tests/estimators/diagnose/known_motor.h"
#include "tests/estimators/fit/synthetic.h"

namespace imrig::est {
namespace {

using synthetic::Motor;
using testing::Contains;
using testing::HasSubstr;

MachineParameters<double> truth_of(const Motor& m) {
  return inverse_gamma_of(TCircuit{m.R_s, m.R_r, m.L_ls, m.L_lr, m.L_m});
}

Record steady_record(const Motor& m, const Noise& noise, double voltage, double frequency, double load,
                     std::uint64_t seed) {
  Record r;
  r.id = fmt::format("v{}_f{}_load{}", voltage, frequency, load);
  r.kind = RecordKind::kSteady;
  auto c = synthetic::step_case(m, voltage * frequency, frequency, load * m.slip / frequency, 200e-6, 1500);
  c.step = 0.0;
  r.series = synthetic::record(m, c);
  synthetic::add_noise(r.series, noise.current_A, noise.voltage_V, noise.speed_rad_s, seed);
  return r;
}

// Operating points as a lab takes them, from no load to overload, no step anywhere, no dc test.
DataSet steady_set(const Motor& m, std::uint64_t seed = 1) {
  DataSet data;
  data.name = m.name;
  data.pole_pairs = m.pole_pairs;
  data.noise.current_A = 0.002 * m.v_peak_V * m.slip / m.R_r;
  data.noise.voltage_V = 0.001 * m.v_peak_V;
  data.noise.speed_rad_s = rad_s_of_rpm(0.2);
  for (const double frequency : {0.5, 1.0}) {
    for (const double voltage : {0.6, 0.9}) {
      for (const double load : {0.02, 0.5, 1.2})
        data.records.push_back(steady_record(m, data.noise, voltage, frequency, load, ++seed));
    }
  }
  data.records[4].holdout = true;
  return data;
}

void expect_truth(const Motor& m, const Model& model, double within) {
  const auto t = truth_of(m);
  const std::array truth{t.R_s, t.R_r, t.L_l, t.L_m};
  for (std::size_t k = 0; k < truth.size(); ++k) {
    const auto& base = base_parameters()[k];
    const Parameter& p = model.*base.place;
    std::printf("%-22s %s %10.6g %11.6g [%10.6g, %10.6g] %s\n", m.name, base.name, truth[k], p.value,
                p.ci95_low, p.ci95_high, p.found.c_str());
    EXPECT_NEAR(p.value / truth[k], 1.0, within) << m.name << " " << base.name;
    EXPECT_NEAR(p.value, truth[k], 1.5 * 0.5 * (p.ci95_high - p.ci95_low)) << m.name << " " << base.name;
  }
}

TEST(StartFromData, SteadyRecordsTellEveryMotorTogetherWithoutStepsAndWithoutDcTest) {
  for (const Motor& m : synthetic::motors()) {
    const DataSet data = steady_set(m);
    const IdentifyResult result = identify(data);
    expect_truth(m, result.model, 0.03);
    EXPECT_THAT(result.model.L_l.found, HasSubstr("all records together"));
    EXPECT_THAT(result.notes, Contains(HasSubstr("records together")));
    EXPECT_EQ(to_toml(parse_model(to_toml(result.model), "m.toml")), to_toml(result.model));
    EXPECT_TRUE(result.records[4].used_for.empty()) << "a hold-out record is never fitted";
    EXPECT_THAT(result.records[5].used_for, Contains("L_l"));
    EXPECT_LT(result.model.history.back().holdout_nrmse, 0.02);
  }
}

// Four parameters, 10 draws of the noise: a 95 % interval misses 2 of 40.
TEST(StartFromData, IntervalsHoldTheTruthAsOftenAsTheySay) {
  const Motor& m = synthetic::motors()[1];
  const auto t = truth_of(m);
  const std::array truth{t.R_s, t.R_r, t.L_l, t.L_m};
  Model empty;
  empty.pole_pairs = m.pole_pairs;
  int held = 0, all = 0;
  for (std::uint64_t draw = 0; draw < 10; ++draw) {
    const Model model = start_from_data(empty, steady_set(m, 1000 * (draw + 1)), 2).model;
    for (std::size_t k = 0; k < truth.size(); ++k) {
      const Parameter& p = model.*base_parameters()[k].place;
      ++all;
      held += p.ci95_low < truth[k] && truth[k] < p.ci95_high ? 1 : 0;
    }
  }
  std::printf("95 %% intervals hold the truth %d times of %d\n", held, all);
  EXPECT_GE(held, 34);
}

TEST(StartFromData, NoStartFromOutsideDecidesNorTheNumberOfThreads) {
  const Motor& m = synthetic::motors()[1];
  const DataSet data = steady_set(m);
  Model empty;
  empty.pole_pairs = m.pole_pairs;
  const DataStart one = start_from_data(empty, data, 1), four = start_from_data(empty, data, 4);
  EXPECT_EQ(to_toml(one.model), to_toml(four.model));
  EXPECT_EQ(one.together.size(), 4u);
  // Many circuits are tried, far from each other.
  const auto rough = rough_circuits(data, {kMissing, kMissing, kMissing, kMissing}, 24, 2);
  ASSERT_GE(rough.size(), 10u);
  double low = 1e9, high = 0.0;
  for (const auto& c : rough) low = std::min(low, c.L_l), high = std::max(high, c.L_l);
  EXPECT_GT(high, 3.0 * low);
}

TEST(StartFromData, WhatIsKnownWellIsHeldToTheBit) {
  const Motor& m = synthetic::motors()[1];
  const auto t = truth_of(m);
  Model model;
  model.pole_pairs = m.pole_pairs;
  model.R_s = {1.002 * t.R_s, 0.998 * t.R_s, 1.006 * t.R_s, "ohm", "dc test, 3 records"};
  model.L_m = {t.L_m, kMissing, kMissing, "H", "given"};
  const DataStart start = start_from_data(model, steady_set(m), 2);
  EXPECT_EQ(start.model.R_s.value, model.R_s.value);
  EXPECT_EQ(start.model.L_m.value, model.L_m.value);
  EXPECT_THAT(start.together, testing::ElementsAre("R_r", "L_l"));
  EXPECT_NEAR(start.model.R_r.value / t.R_r, 1.0, 0.01);
  EXPECT_NEAR(start.model.L_l.value / t.L_l, 1.0, 0.03);
}

TEST(StartFromData, ACompleteModelIsLeftAlone) {
  const DataStart start = start_from_data(test::KnownMotor().model(), steady_set(synthetic::motors()[1]), 2);
  EXPECT_EQ(to_toml(start.model), to_toml(test::KnownMotor().model()));
  EXPECT_EQ(start.sentence, "");
}

TEST(StartFromData, AnIntervalWiderThanTheValueIsNoResult) {
  EXPECT_TRUE(is_result({1.0, 0.6, 1.4, "ohm", ""}));
  EXPECT_TRUE(is_result({1.0, kMissing, kMissing, "ohm", "given"}));
  EXPECT_FALSE(is_result({8.9, -59.0, 76.0, "ohm", "dc test"}));
  EXPECT_FALSE(is_result({-1.0, -1.1, -0.9, "ohm", ""}));
  EXPECT_FALSE(is_result({}));
}

DataSet table_of(const test::KnownMotor& motor) {
  std::vector<SteadyPoint> points;
  for (const double v : {100.0, 140.0, 180.0}) {
    for (const double slip : {1e-4, 0.01, 0.02, 0.035, 0.3, 1.0})
      points.push_back(test::steady_point(motor, 60.0, slip, v));
  }
  return test::table_set(std::move(points), 0.01);
}

TEST(StartFromData, ATableTellsTheMotorWithoutAStart) {
  const test::KnownMotor motor;
  Model empty;
  empty.pole_pairs = 2;
  const DataStart start = start_from_data(empty, table_of(motor), 2);
  EXPECT_TRUE(start.starts.empty()) << start.sentence;
  EXPECT_NEAR(start.model.R_s.value / motor.R_s, 1.0, 0.02);
  EXPECT_NEAR(start.model.R_r.value / motor.R_r, 1.0, 0.02);
  EXPECT_NEAR(start.model.L_l.value / motor.L_l, 1.0, 0.02);
  EXPECT_NEAR(start.model.L_m.value / motor.L_m, 1.0, 0.02);
}

// One operating point gives two numbers.
TEST(StartFromData, WhatTheDataLeaveOpenIsAStartAndSaysSoEverywhere) {
  const Motor& m = synthetic::motors()[1];
  DataSet data = steady_set(m);
  data.records = {data.records.back()};
  Model model;
  model.pole_pairs = m.pole_pairs;
  model.R_s = {m.R_s, 0.99 * m.R_s, 1.01 * m.R_s, "ohm", "dc test, 2 records"};
  const DataStart start = start_from_data(model, data, 2);
  EXPECT_THAT(start.starts, Contains("L_l"));
  EXPECT_TRUE(start.model.L_l.known());
  EXPECT_TRUE(is_start(start.model.L_l));
  EXPECT_TRUE(std::isnan(start.model.L_l.ci95_high));
  EXPECT_THAT(start.sentence, HasSubstr("no result"));
  EXPECT_NO_THROW(start.model.machine());
  const std::string file = to_toml(start.model);
  EXPECT_THAT(file, HasSubstr("found = \"rough start, no result"));
  EXPECT_TRUE(is_start(parse_model(file, "m.toml").L_l)) << "the mark stays in the file";
  IdentifyResult result;
  result.model = start.model;
  const auto json = nlohmann::json::parse(to_json(result));
  EXPECT_EQ(json["model"]["L_l"]["determined"], false);
  EXPECT_TRUE(json["model"]["L_l"]["ci95"][0].is_null());
  EXPECT_EQ(json["model"]["R_s"]["determined"], true);
}

TEST(StartFromData, ARecordOfAnotherMotorHasNoVote) {
  const Motor& m = synthetic::motors()[1];
  DataSet data = steady_set(m);
  for (auto& i : data.records[0].series.i) i *= 3.0;
  Model empty;
  empty.pole_pairs = m.pole_pairs;
  expect_truth(m, start_from_data(empty, data, 2).model, 0.03);
}

TEST(StartFromData, DataWithoutMotionAreRefusedInOneSentence) {
  DataSet data = test::data_set({});
  EXPECT_THROW(start_from_data(Model{}, data, 1), Error);
}

TEST(StartFromData, TheRefusalOfAnIncompleteModelSaysWhatToDo) {
  Model model;
  model.R_s.value = 1.0;
  try {
    model.machine();
    FAIL();
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), testing::AllOf(HasSubstr("does not know R_r"), HasSubstr("imrig identify"),
                                         HasSubstr("imrig improve")));
  }
}

}  // namespace
}  // namespace imrig::est
