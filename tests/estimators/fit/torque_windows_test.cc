// Shaft torque of time series as a balance, against the textbook's T circuit.

#include "estimators/fit/global/torque_windows.h"

#include <gtest/gtest.h>

#include <cmath>

#include "estimators/fit/global/global_problem.h"
#include "tests/estimators/fit/shaft_torque.h"

namespace imrig::est {
namespace {

using namespace shaft_torque;

// Model's torque over measured, of the first record.
double predicted_over_measured(const DataSet& data, const MachineParameters<double>& p) {
  const GlobalProblem problem(data, p, 1, kThinnedTime_s, true);
  GlobalPoint point = problem.start(at(p));
  problem.settle(point, {0, 1, 2, 3}, problem.all());
  RecordTrace trace;
  problem.evaluate_one(0, point.shared, point.local[0], {}, &trace);
  EXPECT_EQ(trace.torque_Nm.size(), 1u);
  return trace.torque_Nm.empty() ? 0.0 : trace.torque_Nm[0] / problem.entries()[0].series->torque[0].mean_Nm;
}

TEST(ShaftTorque, IsTheTextbooksForEveryMotorSpeedAndDirection) {
  for (const auto& motor : synthetic::motors()) {
    for (const double f : {0.3, 1.0, -0.7}) {
      const DataSet data = set_of(motor, {record_of(motor, {f, motor.slip})});
      EXPECT_NEAR(predicted_over_measured(data, truth(motor)), 1.0, 2e-4) << motor.name << " at " << f;
    }
  }
}

TEST(ShaftTorque, HangsOnThePowerAndNotOnTheSlip) {
  const auto& motor = synthetic::motors()[1];
  auto p = truth(motor);
  p.R_r *= 1.3;
  EXPECT_NEAR(predicted_over_measured(set_of(motor, {record_of(motor, {1.0, motor.slip})}), p), 1.0, 3e-3);
}

TEST(ShaftTorque, BehindAFilterOfTheVoltageIsTheSame) {
  const auto& motor = synthetic::motors()[1];
  const DataSet data = set_of(motor, {record_of(motor, {.slip = motor.slip, .filter_s = 1e-3})});
  EXPECT_NEAR(predicted_over_measured(data, truth(motor)), 1.0, 3e-4);
}

TEST(ShaftTorque, LessFrictionIsWhatFrictionTakes) {
  const auto& motor = synthetic::motors()[1];
  const DataSet data = set_of(motor, {record_of(motor, {1.0, motor.slip}, 0.8)});
  const auto p = truth(motor);
  const GlobalProblem problem(data, p, 1, kThinnedTime_s, true);
  GlobalPoint point = problem.start(at(p));
  problem.settle(point, {0, 1, 2, 3}, problem.all());
  const auto chi2 = [&] {
    return problem.evaluate(point, {{}, {}}, problem.all()).records[0].torque.chi2_beside({});
  };
  const double without = chi2();
  point.shared[entry_of("friction_windage.coulomb_Nm")] = 0.8;
  EXPECT_GT(without, 50.0);
  EXPECT_LT(chi2(), 0.1);
}

TEST(ShaftTorque, HasTheDerivativesOfDifferences) {
  const auto& motor = synthetic::motors()[1];
  const DataSet data = set_of(motor, {record_of(motor, {0.8, motor.slip, 0.1, 5e-4}, 0.5)});
  const auto p = truth(motor);
  const GlobalProblem problem(data, p, 1, kThinnedTime_s, true);
  GlobalPoint point = problem.start(at(p));
  for (const auto& [name, value] : {std::pair{"core_loss.eddy_S", 1e-3},
                                    {"core_loss.place", 0.4},
                                    {"friction_windage.coulomb_Nm", 0.3},
                                    {"friction_windage.windage_Nms2", 1e-5},
                                    {"stray_load_loss.drag_Nm_per_A2", 1e-3},
                                    {"stray_load_loss.speed_exponent", 0.7},
                                    {"stray_load_loss.stator_share", 0.3},
                                    {"torque_sensor.gain", 0.01},
                                    {"torque_sensor.offset_Nm", 0.1}})
    point.shared[entry_of(name)] = value;
  problem.settle(point, {0, 1, 2, 3}, problem.all());
  Freedom free{{0, 1, 2, 3}, {}};
  for (std::size_t e = kBase; e < kShared; ++e) {
    const std::string effect = kEffectInfos[effect_of_shared(e)].name;
    if (effect == "friction_windage" || effect == "stray_load_loss" || effect == "torque_sensor" ||
        shared_name(e) == "core_loss.eddy_S")
      free.shared.push_back(e);
  }
  const GlobalTerms terms = problem.evaluate(point, free, problem.all());
  for (std::size_t m = 0; m < free.shared.size(); ++m) {
    GlobalPoint above = point, below = point;
    const double x = point.shared[free.shared[m]], h = 1e-4 * std::max(std::abs(x), 1e-3);
    above.shared[free.shared[m]] += h, below.shared[free.shared[m]] -= h;
    const double slope = (problem.evaluate(above, free, problem.all()).chi2 -
                          problem.evaluate(below, free, problem.all()).chi2) /
                         (4.0 * h);
    const double gradient = terms.gradient[static_cast<Eigen::Index>(m)];
    EXPECT_NEAR(gradient, slope, 2e-3 * std::abs(slope) + 1e-6) << shared_name(free.shared[m]);
  }
}

std::vector<TorqueWindow> windows_of(const TimeSeries& series, int pole_pairs) {
  const DrivenRecord record = driven_record(series, pole_pairs);
  return torque_windows(series.torque_Nm, record.frame, record.thinned);
}

TEST(TorqueWindows, AreCutWhereTheSpeedMovesAndLeftOutWhereItNeverStands) {
  const auto& motor = synthetic::motors()[1];
  const double w_0 = 2.0 * kPi * motor.f_Hz / motor.pole_pairs;
  auto c = synthetic::step_case(motor, 0.9, 1.0, motor.slip, kStep_s, 8000);
  c.fine = 4;
  const auto windows = [&](const std::function<double(double)>& speed) {
    c.speed_rad_s = speed;
    TimeSeries series = synthetic::record(motor, c);
    series.torque_Nm.assign(series.size(), 10.0);
    return windows_of(series, motor.pole_pairs);
  };
  EXPECT_EQ(windows([&](double) { return 0.97 * w_0; }).size(), 1u);
  EXPECT_TRUE(windows([&](double t) { return 0.3 * w_0 * (1.0 + t); }).empty()) << "it runs up";
  const auto halves = windows([&](double t) { return w_0 * (t < 0.8 ? 0.98 : 0.96); });
  EXPECT_GE(halves.size(), 2u);
  for (const TorqueWindow& w : halves) EXPECT_LT(w.hidden_Nm, 0.02 * w.apparent_Nm);
  EXPECT_TRUE(windows([](double) { return 0.0; }).empty()) << "friction of a shaft at rest is anything";
}

std::string refused(const synthetic::Motor& motor, double factor, double lost_Nm, double R_s_times,
                    const std::vector<double>& slips) {
  std::vector<Record> records;
  for (const double f : {0.4, 1.0}) {
    for (const double slip : slips) records.push_back(record_of(motor, {f, slip}, lost_Nm));
  }
  for (Record& r : records) {
    for (double& T : r.series.torque_Nm) T *= factor;
  }
  const DataSet data = set_of(motor, std::move(records));
  auto p = truth(motor);
  p.R_s *= R_s_times;
  return GlobalProblem(data, p, 1, kThinnedTime_s, true).torque_refused();
}

TEST(TorqueWindows, OfAWrongSignOrUnitAreRefused) {
  const auto& motor = synthetic::motors()[1];
  const std::vector<double> loads{0.01, 0.02, 0.04};
  EXPECT_EQ(refused(motor, 1.0, 0.0, 1.0, loads), "");
  EXPECT_NE(refused(motor, -1.0, 0.0, 1.0, loads).find("-1 times"), std::string::npos);
  EXPECT_NE(refused(motor, 0.7376, 0.0, 1.0, loads).find("0.738 times"), std::string::npos) << "pound-feet";
  EXPECT_NE(refused(motor, 0.0, 0.0, 1.0, loads).find("zero throughout"), std::string::npos);
}

TEST(TorqueWindows, AreNotRefusedForFrictionNorForARoughResistance) {
  const auto& motor = synthetic::motors()[1];
  const std::vector<double> loads{0.01, 0.02, 0.04}, one{0.012};
  EXPECT_EQ(refused(motor, 1.0, 2.0, 1.0, loads), "");
  EXPECT_EQ(refused(motor, 1.0, 0.0, 6.0, loads), "") << "R_s of a spoiled DC test";
  EXPECT_EQ(refused(motor, 1.0, 1.5, 1.0, one), "") << "one load tells no factor from friction";
}

// A ripple that keeps step with any regular choice of samples: 1 % offset of a current channel, 40 samples a
// period.
TEST(TorqueWindows, AreMeansWhateverThePeriodOfARipple) {
  const auto& motor = synthetic::motors()[1];
  for (const std::size_t samples : {2440u, 2500u, 5000u, 5120u}) {
    auto c = synthetic::step_case(motor, 0.9, 50.0 / motor.f_Hz, motor.slip, 5e-4, samples);
    c.step = 0.0;
    Record r;
    r.id = "offset", r.kind = RecordKind::kSteady;
    r.series = synthetic::record(motor, c);
    double largest = 0.0;
    for (const auto& i : r.series.i) largest = std::max(largest, std::abs(i));
    for (auto& i : r.series.i) i += 0.01 * largest;
    r.series.torque_Nm.assign(samples, textbook_torque_Nm(motor, c.v_peak_V, c.f_Hz, motor.slip));
    EXPECT_NEAR(predicted_over_measured(set_of(motor, {r}), truth(motor)), 1.0, 2e-3) << samples;
  }
}

TEST(TorqueWindows, TakeChannelsWithGaps) {
  const auto& motor = synthetic::motors()[1];
  Record r = record_of(motor, {1.0, motor.slip});
  for (std::size_t k = 0; k < r.series.torque_Nm.size(); ++k) {
    if (k % 10 != 3) r.series.torque_Nm[k] = kMissing;
  }
  EXPECT_NEAR(predicted_over_measured(set_of(motor, {r}), truth(motor)), 1.0, 1e-3);
  std::fill(r.series.torque_Nm.begin(), r.series.torque_Nm.end(), kMissing);
  EXPECT_TRUE(windows_of(r.series, motor.pole_pairs).empty());
}

TEST(TorqueWindows, AreNotFittedUnlessAskedFor) {
  const auto& motor = synthetic::motors()[1];
  const DataSet data = set_of(motor, {record_of(motor, {1.0, motor.slip}, 3.0)});
  const GlobalProblem problem(data, truth(motor), 1);
  EXPECT_FALSE(problem.has_torque());
  EXPECT_TRUE(problem.entries()[0].series->torque.empty());
}

TEST(TorqueSums, LeaveATransducerItsAccuracyAndNoMore) {
  TorqueSums off;
  for (const double T : {2.0, 5.0, 10.0, 20.0}) off.add(0.002 * T + 0.01, T, 0.01);
  const TransducerAccuracy accuracy{0.002, 0.01};
  // One sigma of each: the penalty is near 1 + 1, what is left of the errors near nothing.
  EXPECT_LT(off.chi2_beside(accuracy), 2.0);
  EXPECT_GT(off.chi2_beside({1e-9, 1e-9}), 25.0);
  TorqueSums scattered;
  for (const double sign : {1.0, -1.0, 1.0, -1.0}) scattered.add(sign * 0.05, 10.0, 0.01);
  EXPECT_NEAR(scattered.chi2_beside(accuracy), 100.0, 1e-9);
}

}  // namespace
}  // namespace imrig::est
