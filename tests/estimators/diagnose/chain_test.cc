// identify, then diagnose, on data where no record alone tells the motor: the chain goes through, and names
// what is there.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "estimators/diagnose/compare.h"
#include "estimators/diagnose/diagnose.h"
#include "estimators/fit/identify.h"
#include "rig/base/space_vector.h"
#include "tests/estimators/diagnose/known_motor.h"
#include "tests/estimators/fit/synthetic.h"

namespace imrig::est {
namespace {

using synthetic::Motor;

const Motor& motor() { return synthetic::motors()[1]; }
double rated_A() { return motor().v_peak_V * motor().slip / motor().R_r; }

DataSet empty_set(double voltage_noise) {
  DataSet data;
  data.name = "bench";
  data.pole_pairs = motor().pole_pairs;
  data.noise = {2e-3 * rated_A(), voltage_noise * motor().v_peak_V, 0.03, kMissing, kMissing};
  return data;
}

Record record_of(const DataSet& data, double voltage, double frequency, double load, double step,
                 std::uint64_t seed) {
  Record r;
  r.id = fmt::format("v{}_f{}_load{}", voltage, frequency, load);
  r.kind = step > 0.0 ? RecordKind::kStep : RecordKind::kSteady;
  auto c = synthetic::step_case(motor(), voltage * frequency, frequency, load * motor().slip / frequency,
                                200e-6, 1500);
  c.step = step;
  r.series = synthetic::record(motor(), c);
  synthetic::add_noise(r.series, data.noise.current_A, data.noise.voltage_V, data.noise.speed_rad_s, seed);
  return r;
}

void add_grid(DataSet& data, double step) {
  std::uint64_t seed = 20;
  for (const double frequency : {0.4, 0.7, 1.0}) {
    for (const double voltage : {0.6, 0.9}) {
      for (const double load : {0.1, 0.5, 1.1}) {
        data.records.push_back(record_of(data, voltage, frequency, load, step, ++seed));
        data.records.back().holdout = seed % 6 == 0;
      }
    }
  }
}

// One level of direct current a record.
Record dc_record(const DataSet& data, double current_A, std::uint64_t seed) {
  Record r;
  r.id = fmt::format("dc_{:.0f}", current_A);
  r.kind = RecordKind::kDc;
  r.series.sample_time_s = 200e-6;
  for (int k = 0; k < 1500; ++k) {
    const SpaceVector i = -current_A * std::polar(1.0, 2.0 * kPi / 3.0);
    r.series.i.push_back(i);
    r.series.v.push_back(motor().R_s * i);
    r.series.speed_rad_s.push_back(0.0);
  }
  synthetic::add_noise(r.series, data.noise.current_A, data.noise.voltage_V, 0.0, seed);
  return r;
}

// The voltage is the command: the inverter loses `drop` against the sign of each phase current.
void command(Record& r, double drop_V, double width_A) {
  for (std::size_t k = 0; k < r.series.size(); ++k) {
    const auto i = phases(r.series.i[k]);
    const auto lost = [&](double x) { return drop_V * std::tanh(x / width_A); };
    r.series.v[k] += space_vector(lost(i[0]), lost(i[1]), lost(i[2]));
  }
}

// The whole chain; what no step of it may do is refuse.
Diagnosis chain(const DataSet& data) {
  const IdentifyResult result = identify(data);
  EXPECT_NO_THROW(result.model.machine());
  EXPECT_NO_THROW(compare(result.model, data));
  for (const auto& base : base_parameters()) {
    const Parameter& p = result.model.*base.place;
    std::printf("  %s %.5g [%.5g, %.5g] %s\n", base.name, p.value, p.ci95_low, p.ci95_high, p.found.c_str());
  }
  Diagnosis d = diagnose(result.model, data);
  std::printf("  %s %s\n", d.verdict.c_str(), d.effect.c_str());
  return d;
}

TEST(Chain, SteadyRecordsWithoutStepsOfAMotorThatLacksNothing) {
  DataSet data = empty_set(1e-3);
  add_grid(data, 0.0);
  EXPECT_EQ(chain(data).verdict, "adequate");
}

TEST(Chain, DeadTimeOnCommandedVoltagesSpoilsTheDcTestAndIsNamed) {
  DataSet data = empty_set(1e-4);
  data.records = {dc_record(data, 0.3 * rated_A(), 1), dc_record(data, rated_A(), 2)};
  add_grid(data, 0.1);
  for (Record& r : data.records) command(r, 0.04 * motor().v_peak_V, 0.03 * rated_A());
  const Diagnosis d = chain(data);
  EXPECT_EQ(d.effect, "inverter_dead_time") << d.verdict;
}

// The magnetizing current of the rotor's flux grows faster than the flux.
SteadyPoint saturated_point(test::KnownMotor m, double f_Hz, double slip, double v_V) {
  const double L_m = m.L_m;
  for (int round = 0; round < 300; ++round) {
    const double w = 2.0 * kPi * f_Hz;
    const SpaceVector i = v_V / m.impedance(f_Hz, slip);
    const double psi = std::abs((v_V - SpaceVector(m.R_s, w * m.L_l) * i) / w);
    m.L_m = 0.5 * m.L_m + 0.5 * L_m / (1.0 + 0.6 * std::pow(psi / 0.45, 6.0));
  }
  return test::steady_point(m, f_Hz, slip, v_V);
}

DataSet saturated_table(const std::vector<double>& voltages) {
  std::vector<SteadyPoint> points;
  for (const double v : voltages) {
    for (const double slip : {5e-4, 0.01, 0.02, 0.035}) points.push_back(saturated_point({}, 60.0, slip, v));
  }
  return test::table_set(std::move(points), 0.02);
}

TEST(Chain, ATableOfSaturatedIronIsNamed) {
  const Diagnosis d = chain(saturated_table({60.0, 90.0, 120.0, 140.0, 160.0, 180.0}));
  EXPECT_EQ(d.effect, "magnetizing_saturation") << d.verdict;
}

TEST(Chain, DcRecordsAndATableOfSaturatedIronAreNamed) {
  DataSet data = saturated_table({130.0, 150.0, 165.0, 180.0, 195.0});
  DataSet channels = empty_set(1e-3);
  data.records.push_back(dc_record(channels, 0.3 * rated_A(), 3));
  data.records.push_back(dc_record(channels, rated_A(), 4));
  EXPECT_EQ(chain(data).effect, "magnetizing_saturation");
}

TEST(Chain, AModelFileWithoutParametersIsFilledFromTheDataAndItIsSaid) {
  DataSet data = empty_set(1e-3);
  add_grid(data, 0.0);
  Model empty;
  empty.pole_pairs = motor().pole_pairs;
  const Improvement found = improve(empty, data);
  EXPECT_EQ(found.diagnosis.verdict, "adequate");
  EXPECT_NE(found.diagnosis.explanation.front().find("does not know all of its parameters"),
            std::string::npos);
  EXPECT_NO_THROW(found.model.machine());
  EXPECT_NEAR(found.model.R_s.value / motor().R_s, 1.0, 0.02);
}

}  // namespace
}  // namespace imrig::est
