#include "estimators/diagnose/compare.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "rig/base/error.h"
#include "tests/estimators/diagnose/known_motor.h"

namespace imrig::est {
namespace {

using test::data_set;
using test::KnownMotor;
using test::steady_point;
using test::steady_record;
using test::SteadyRun;

const KnownMotor kMotor;

const ChannelResult& current(const CompareResult& result, std::size_t k = 0) {
  return result.records.at(k).channels.at("current_A");
}

TEST(Compare, TheRightModelLeavesNothing) {
  const auto result = compare(kMotor.model(), data_set({steady_record(kMotor, "a", {})}));
  EXPECT_LT(current(result).nrmse, 1e-4);
  EXPECT_LT(result.records[0].channels.at("input_power_W").nrmse, 1e-4);
  EXPECT_TRUE(std::isnan(current(result).floor)) << "nothing is known about the noise";
  EXPECT_TRUE(std::isnan(current(result).chi2_per_dof));
  EXPECT_TRUE(std::isnan(result.holdout.nrmse));
  EXPECT_EQ(result.fitted.records, 1u);
  EXPECT_FALSE(result.notes.empty());
  const Conditions& c = result.records[0].conditions;
  EXPECT_NEAR(c.f_Hz, 50.0, 1e-4);
  EXPECT_NEAR(c.slip, 0.03, 1e-6);
  EXPECT_NEAR(c.torque_Nm, steady_point(kMotor, 50.0, 0.03, 200.0).torque_Nm, 0.01);
}

TEST(Compare, AWrongModelShowsTheErrorThatPhasorsPredict) {
  KnownMotor wrong = kMotor;
  wrong.L_l *= 1.1;
  wrong.R_r *= 0.95;
  // Six rotor time constants: what the initial flux can take up is gone.
  SteadyRun run;
  run.sample_time_s = 1e-3;
  run.samples = 20000;
  const auto result = compare(wrong.model(), data_set({steady_record(kMotor, "a", run)}));
  const double expected = std::abs(kMotor.impedance(50.0, 0.03) / wrong.impedance(50.0, 0.03) - 1.0);
  EXPECT_NEAR(current(result).nrmse, expected, 0.02 * expected);
  EXPECT_GT(expected, 0.02);
}

// Current noise alone: chi2 per degree of freedom is 1, and the error is the floor.
TEST(Compare, CurrentNoiseIsTheFloor) {
  SteadyRun run;
  run.sigma_i = 0.1;
  DataSet data = data_set({steady_record(kMotor, "a", run)});
  data.noise.current_A = 0.1;
  const auto result = compare(kMotor.model(), data);
  EXPECT_NEAR(current(result).chi2_per_dof, 1.0, 0.06);
  EXPECT_NEAR(current(result).nrmse / current(result).floor, 1.0, 0.03);
  EXPECT_NEAR(result.records[0].channels.at("input_power_W").chi2_per_dof, 1.0, 0.08);
  EXPECT_EQ(result.records[0].floor_from, "declared noise");
}

// Voltage and speed noise reach the error only through the model; the floor must know.
TEST(Compare, TheFloorCountsVoltageAndSpeedNoisePassedThroughTheModel) {
  SteadyRun run;
  run.sigma_i = 0.02;
  run.sigma_v = 8.0;
  run.sigma_w = 1.0;
  run.samples = 8000;
  DataSet data = data_set({steady_record(kMotor, "a", run)});
  data.noise.current_A = run.sigma_i;
  const double blind = current(compare(kMotor.model(), data)).chi2_per_dof;
  EXPECT_GT(blind, 3.0);
  data.noise.voltage_V = run.sigma_v;
  data.noise.speed_rad_s = run.sigma_w;
  const auto result = compare(kMotor.model(), data);
  EXPECT_NEAR(current(result).chi2_per_dof, 1.0, 0.35) << "coloured noise: few independent values";
  EXPECT_NEAR(current(result).nrmse / current(result).floor, 1.0, 0.18);
}

TEST(Compare, TheFloorComesFromRepeatsWhereThereAreAny) {
  KnownMotor wrong = kMotor;
  wrong.R_r *= 1.2;
  std::vector<Record> records;
  for (unsigned k = 0; k < 4; ++k) {
    SteadyRun run;
    run.sigma_i = 0.2;
    run.seed = k + 1;
    run.phase = 1.3 * k;  // repeats do not start at the same angle of the supply
    records.push_back(steady_record(kMotor, "r" + std::to_string(k), run));
    if (k > 0) records.back().repeat_of = "r0";
  }
  DataSet data = data_set(records);
  data.noise.current_A = 99.0;  // declared wrongly: what is measured counts
  const auto result = compare(wrong.model(), data);
  const double signal = std::abs(200.0 / kMotor.impedance(50.0, 0.03));
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_EQ(result.records[k].floor_from, "repeats");
    EXPECT_NEAR(current(result, k).floor, 0.2 * std::sqrt(2.0) / signal,
                0.03 * 0.2 * std::sqrt(2.0) / signal);
    EXPECT_GT(current(result, k).nrmse, 3.0 * current(result, k).floor);
    EXPECT_GT(current(result, k).chi2_per_dof, 9.0);
  }
}

TEST(Compare, HoldOutRecordsArePooledApart) {
  KnownMotor other = kMotor;
  other.R_r *= 1.3;
  Record held = steady_record(other, "held", {});
  held.holdout = true;
  const auto result = compare(
      kMotor.model(), data_set({steady_record(kMotor, "a", {}), held, steady_record(kMotor, "b", {})}));
  EXPECT_EQ(result.fitted.records, 2u);
  EXPECT_EQ(result.holdout.records, 1u);
  EXPECT_LT(result.fitted.nrmse, 1e-4);
  EXPECT_NEAR(result.holdout.nrmse, current(result, 1).nrmse, 1e-15);
  EXPECT_GT(result.holdout.nrmse, 0.01);
}

TEST(Compare, PoolingWeighsErrorsBySignal) {
  KnownMotor other = kMotor;
  other.R_r *= 1.1;
  SteadyRun small;
  small.v_V = 20.0;
  const auto result =
      compare(other.model(), data_set({steady_record(kMotor, "a", {}), steady_record(kMotor, "b", small)}));
  const auto &a = current(result, 0), &b = current(result, 1);
  EXPECT_NEAR(result.fitted.nrmse, std::sqrt((a.error2 + b.error2) / (a.signal2 + b.signal2)), 1e-15);
}

TEST(Compare, PointsAreComparedOneByOneInTheTablesUnits) {
  Record table;
  table.id = "table";
  table.kind = RecordKind::kPoints;
  for (const double slip : {0.01, 0.02, 0.04})
    table.points.push_back(steady_point(kMotor, 50.0, slip, 200.0));
  table.points[1].p_in_W = kMissing;
  const auto result = compare(kMotor.model(), data_set({table}));
  const ComparedRecord& record = result.records[0];
  ASSERT_EQ(record.points.size(), 3u);
  for (const char* channel : {"current_A", "input_power_W", "power_factor", "torque_Nm", "output_power_W"}) {
    EXPECT_LT(record.channels.at(channel).nrmse, 1e-12) << channel;
  }
  EXPECT_EQ(record.channels.at("input_power_W").values, 2u);
  const auto& pair = record.points[2].channels.at("current_A");
  EXPECT_NEAR(pair.measured, table.points[2].i_peak_A / std::sqrt(2.0), 1e-12);
  EXPECT_TRUE(std::isnan(record.points[1].channels.at("input_power_W").measured));
  EXPECT_FALSE(std::isnan(record.points[1].channels.at("input_power_W").predicted));
  EXPECT_NEAR(record.points[2].conditions.slip, 0.04, 1e-12);
}

// Speed noise is drawn by hand; what it does to the error must be what the floor says.
TEST(Compare, ThePointsFloorCountsSpeedAndVoltageNoise) {
  std::mt19937_64 random(4);
  std::normal_distribution<double> draw(0.0, 1.0);
  Record table;
  table.id = "table";
  table.kind = RecordKind::kPoints;
  DataSet data = data_set({});
  data.noise.current_A = 0.05;
  data.noise.power_W = 5.0;
  data.noise.speed_rad_s = 0.1;
  data.noise.voltage_V = 0.5;
  for (int k = 0; k < 3000; ++k) {
    SteadyPoint p = steady_point(kMotor, 50.0, 0.01 + 0.04 * (k % 100) / 100.0, 200.0);
    p.i_peak_A += 0.05 * draw(random);
    p.p_in_W += 5.0 * draw(random);
    p.speed_rad_s += 0.1 * draw(random);
    p.v_peak_V += 0.5 * draw(random);
    table.points.push_back(p);
  }
  data.records.push_back(table);
  const auto result = compare(kMotor.model(), data);
  for (const char* channel : {"current_A", "input_power_W"}) {
    EXPECT_NEAR(result.records[0].channels.at(channel).chi2_per_dof, 1.0, 0.1) << channel;
    EXPECT_NEAR(result.records[0].channels.at(channel).nrmse / result.records[0].channels.at(channel).floor,
                1.0, 0.05)
        << channel;
  }
  EXPECT_TRUE(std::isnan(result.records[0].channels.at("torque_Nm").chi2_per_dof)) << "torque noise is not declared";
}

TEST(Compare, WhatCannotBeJudgedIsKeptWithItsReason) {
  SteadyRun brief;
  brief.samples = 10;
  const auto result = compare(
      kMotor.model(), data_set({steady_record(kMotor, "brief", brief), steady_record(kMotor, "a", {})}));
  EXPECT_NE(result.records[0].left_out, "");
  EXPECT_TRUE(result.records[0].channels.empty());
  EXPECT_EQ(result.fitted.records, 1u);
  EXPECT_THROW(compare(kMotor.model(), data_set({steady_record(kMotor, "brief", brief)})), Error);
}

TEST(Compare, AnotherMotorsModelIsRefused) {
  Model model = kMotor.model();
  model.pole_pairs = 3;
  EXPECT_THROW(compare(model, data_set({steady_record(kMotor, "a", {})})), Error);
  model = kMotor.model();
  model.R_r.value = kMissing;
  EXPECT_THROW(compare(model, data_set({steady_record(kMotor, "a", {})})), Error);
}

TEST(Compare, SameInputGivesTheSameBits) {
  SteadyRun run;
  run.sigma_v = 3.0;
  run.sigma_i = 0.1;
  DataSet data = data_set({steady_record(kMotor, "a", run)});
  data.noise = {0.1, 3.0, 0.05, kMissing, kMissing};
  const double once = current(compare(kMotor.model(), data)).chi2_per_dof;
  const double again = current(compare(kMotor.model(), data)).chi2_per_dof;
  EXPECT_EQ(std::memcmp(&once, &again, sizeof once), 0);
}

TEST(Compare, TheOverlayShowsTheWorstStretchFinely) {
  Record record = steady_record(kMotor, "a", {.samples = 40000});
  for (std::size_t k = 25000; k < 25200; ++k) record.series.i[k] += 5.0;
  const auto result = compare(kMotor.model(), data_set({record}));
  const Overlay& overlay = result.records[0].overlay;
  ASSERT_FALSE(overlay.t_s.empty());
  EXPECT_LE(overlay.t_s.size(), 1200u);
  EXPECT_LE(overlay.t_s.front(), 25000 * 2e-4);
  EXPECT_GE(overlay.t_s.back(), 25199 * 2e-4 - 2e-3);
  EXPECT_LE(overlay.t_s[1] - overlay.t_s[0], 1.0 / 50.0 / 15.0);
}

}  // namespace
}  // namespace imrig::est
