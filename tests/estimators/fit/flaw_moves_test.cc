// What a flaw of the measurement does to the results, against what impedances must do and against motors whose records
// carry the flaw from the beginning.
#include "estimators/fit/flaw_moves.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/estimators/fit/spread.h"

namespace imrig::est {
namespace {

using synthetic::Motor;

// Three loads of the paper's motor, sampled with the voltage late by late_s.
DataSet records(const Motor& motor, double late_s) {
  DataSet data;
  data.name = "flaws";
  data.pole_pairs = motor.pole_pairs;
  for (const double load : {0.6, 1.0, 1.4}) {
    const auto c = synthetic::step_case(motor, 0.8, 0.9, load * motor.slip, 60e-6, 4000);
    Record record;
    record.id = fmt::format("load_{}", load);
    record.kind = RecordKind::kStep;
    record.series = synthetic::record(motor, c);
    const double w_e = 2.0 * kPi * c.f_Hz;
    for (auto& v : record.series.v) v *= std::polar(1.0, -w_e * late_s);
    synthetic::add_noise(record.series, 0.01, 0.0, 0.0, 17);
    data.records.push_back(std::move(record));
  }
  return data;
}

IdentifyOptions options_for(const Motor& motor) {
  const auto truth = synthetic::truth_of(motor);
  IdentifyOptions options;
  options.method = "transient";
  options.nominal = Model{};
  options.nominal->pole_pairs = motor.pole_pairs;
  options.nominal->R_s.value = truth.R_s;
  options.nominal->R_r.value = truth.R_r;
  options.nominal->L_l.value = truth.L_l;
  options.nominal->L_m.value = truth.L_m;
  return options;
}

double moved(const Model& after, const Model& before, Parameter Model::*p) {
  return (after.*p).value / (before.*p).value - 1.0;
}

TEST(FlawMoves, AreThoseOfRecordsThatHadTheFlawFromTheBeginning) {
  const Motor& motor = synthetic::motors()[1];
  const auto options = options_for(motor);
  const Model before = identify(records(motor, 0.0), options).model;
  const auto moves = flaw_moves(records(motor, 0.0), options, before);
  ASSERT_EQ(moves.size(), 4u);
  for (const auto& row : moves) {
    EXPECT_EQ(row.failure, "") << row.flaw;
    for (const auto& [name, by] : row.moved) fmt::print("{}: {} {:+.3f} %\n", row.flaw, name, 100.0 * by);
  }
  const Model late = identify(records(motor, 10e-6), options).model;
  for (const auto& [name, place] : {std::pair{"R_r", &Model::R_r}, {"L_l", &Model::L_l}, {"L_m", &Model::L_m}}) {
    const double by = moved(late, before, place);
    // A turned phase and a shift in time differ where the voltage steps: 0.01 %.
    EXPECT_NEAR(moves[3].moved.at(name), by, 0.05 * std::abs(by) + 1e-4) << name;
  }
}

// Gains scale every impedance, R_s among them.
TEST(FlawMoves, GainsScaleEveryImpedance) {
  const Motor& motor = synthetic::motors()[1];
  auto options = options_for(motor);
  const DataSet data = records(motor, 0.0);
  const Model before = identify(data, options).model;
  for (const auto& [flaw, factor] : {std::pair{Flaw::kCurrentHigh, 1.0 / 1.01}, {Flaw::kVoltageHigh, 1.01}}) {
    options.nominal->R_s.value = synthetic::truth_of(motor).R_s * factor;
    const Model after = identify(flawed(data, flaw), options).model;
    for (const auto place : {&Model::R_r, &Model::L_l, &Model::L_m})
      EXPECT_NEAR(moved(after, before, place), factor - 1.0, 2e-4);
  }
}

TEST(FlawMoves, HalfTheFlawMovesHalfAsFar) {
  const Motor& motor = synthetic::motors()[1];
  const auto options = options_for(motor);
  const DataSet data = records(motor, 0.0);
  const Model before = identify(data, options).model;
  for (const Flaw flaw : {Flaw::kSpeedHigh, Flaw::kVoltageLate}) {
    const Model whole = identify(flawed(data, flaw), options).model, half = identify(flawed(data, flaw, 0.5), options).model;
    for (const auto place : {&Model::R_r, &Model::L_l, &Model::L_m}) {
      const double by = moved(whole, before, place);
      EXPECT_NEAR(2.0 * moved(half, before, place), by, 0.1 * std::abs(by) + 2e-5);
    }
  }
}

TEST(FlawMoves, ALateVoltageTurnsTheTablesPowerAndKeepsItsCurrent) {
  DataSet data;
  SteadyPoint p;
  p.v_peak_V = 100.0, p.i_peak_A = 10.0, p.f_Hz = 50.0, p.p_in_W = 1200.0, p.speed_rad_s = 150.0;
  Record record;
  record.kind = RecordKind::kPoints;
  record.points = {p};
  data.records = {record};
  const SteadyPoint late = flawed(data, Flaw::kVoltageLate).records[0].points[0];
  const double phi = std::acos(1200.0 / 1500.0) - 2.0 * kPi * 50.0 * 10e-6;
  EXPECT_NEAR(late.p_in_W, 1500.0 * std::cos(phi), 1e-9);
  EXPECT_EQ(late.i_peak_A, 10.0);
}

}  // namespace
}  // namespace imrig::est
