// Every experiment of the menu is a plan that the campaign reads, inside the limits it was made for.

#include "estimators/diagnose/next/plan_text.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "estimators/model/steady_state.h"
#include "rig/campaign/feasibility.h"
#include "rig/campaign/plan.h"

namespace imrig::est {
namespace {

MachineParameters<double> machine_of(const MotorConfig& m) {
  return {m.R_s_ohm, m.R_r_ohm, m.L_l_H, m.L_m_H};
}

SteadyPredictor predictor_of(const MotorConfig& m) {
  return [m](double v, double f_Hz, double slip) {
    const double w = 2.0 * kPi * f_Hz;
    const auto s = steady_state(machine_of(m), m.pole_pairs, v, w, w * (1.0 - slip));
    return SteadyPrediction{s.current_A, s.torque_Nm};
  };
}

TEST(NextPlan, OfEveryExperimentIsReadAndFeasibleOnItsRig) {
  const RigConfig rig;
  const RigRange range = range_of(rig);
  const MachineParameters<double> motor = machine_of(rig.motor);
  const auto experiments = menu(range, motor, rig.motor.pole_pairs);
  EXPECT_GE(experiments.size(), 9u);
  std::set<std::string> names;
  for (const Experiment& e : experiments) {
    EXPECT_TRUE(names.insert(e.name).second) << e.name;
    const std::string text = plan_text(e, range, motor, 2, "separates one from another");
    const Plan plan = parse_plan(text, "next.toml");
    EXPECT_EQ(plan.points.size(), 2 * e.records.size() / (e.cold_and_hot ? 2 : 1)) << text;
    for (const CheckedPoint& p : check_points(plan, rig, predictor_of(rig.motor)))
      EXPECT_TRUE(p.feasible) << e.name << ": " << p.point.id << " " << p.why;
  }
}

TEST(NextPlan, AsksForTheVoltagesAndCurrentsOfItsRecords) {
  const RigConfig rig;
  const RigRange range = range_of(rig);
  for (const Experiment& e : menu(range, machine_of(rig.motor), rig.motor.pole_pairs)) {
    if (e.cold_and_hot) continue;
    const Plan plan = parse_plan(plan_text(e, range, machine_of(rig.motor), 1, "x"), "next.toml");
    ASSERT_EQ(plan.points.size(), e.records.size());
    for (std::size_t k = 0; k < e.records.size(); ++k) {
      const PlannedRecord& r = e.records[k];
      EXPECT_LE(r.v_peak_V * (1.0 + r.step), 1.0001 * rig.limits.voltage_V);
      EXPECT_LE(r.current_A, rig.limits.current_A);
      const auto same = std::find_if(plan.points.begin(), plan.points.end(), [&](const PlanPoint& p) {
        const double v = p.voltage_percent / 100.0 * rated_peak_V(rig.motor);
        const bool drive =
            r.kind == RecordKind::kLockedSweep
                ? std::abs(p.level_A - r.current_A) < 1e-3 * r.current_A && p.regulated == r.axis
                : std::abs(v - r.v_peak_V) < 1e-3 * r.v_peak_V;
        return drive && std::abs(p.frequency_Hz - r.f_Hz) < 1e-3 * r.f_Hz;
      });
      EXPECT_NE(same, plan.points.end()) << e.name << ", record " << k;
    }
  }
}

TEST(NextPlan, StaysWithinWhatTheDataHaveSeenWithoutARig) {
  RigRange range;
  range.current_A = 12.0, range.voltage_V = 100.0, range.speed_rad_s = 100.0;
  range.rated_V = 100.0, range.rated_Hz = 40.0;
  const MachineParameters<double> motor = machine_of(MotorConfig{});
  const auto experiments = menu(range, motor, 2);
  ASSERT_FALSE(experiments.empty());
  for (const Experiment& e : experiments) {
    for (const PlannedRecord& r : e.records) {
      EXPECT_LE(r.v_peak_V * (1.0 + r.step), 100.0001);
      if (r.kind == RecordKind::kLockedSweep) continue;
      EXPECT_LE(2.0 * kPi * r.f_Hz / 2.0, 100.0001);
      const double w = 2.0 * kPi * r.f_Hz;
      EXPECT_LE(steady_state(motor, 2, r.v_peak_V, w, w * (1.0 - r.slip)).current_A, 12.0001);
    }
    EXPECT_NO_THROW(parse_plan(plan_text(e, range, motor, 1, "x"), "next.toml")) << e.name;
  }
}

}  // namespace
}  // namespace imrig::est
