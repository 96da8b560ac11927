#include "rig/campaign/feasibility.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "rig/base/generator.h"
#include "tests/rig/campaign/predictors.h"

namespace imrig {
namespace {

using ::testing::HasSubstr;

// Nothing but pull-out binds.
RigConfig wide_rig() {
  RigConfig rig;
  rig.motor.L_l_H = 1.0;  // no transient to speak of
  rig.motor.friction_Nm = 0.0;
  rig.limits.current_A = 1e4;
  rig.limits.speed_rpm = 1e5;
  rig.limits.voltage_V = 1e4;
  rig.dyno.max_A = 100;
  rig.dyno.max_V = 1e4;
  return rig;
}

CheckedPoint check(const std::string& point, const RigConfig& rig, const SteadyPredictor& predict,
                   const std::string& limits = "") {
  const Plan plan = parse_plan("version = 1\nname = \"p\"\n[limits]\nslip = 0.9\n" + limits + point, "p");
  return check_points(plan, rig, predict).front();
}

std::string at(double f, double v, const std::string& rest) {
  return "[[point]]\nfrequency_Hz = " + std::to_string(f) + "\nvoltage_percent = " + std::to_string(v) +
         "\n" + rest + "\n";
}

SteadyPredictor fifty_Nm(const RigConfig& rig) { return test::kloss(50, 0.2, rated_peak_V(rig.motor), 60); }

TEST(Feasibility, PullOutOfKlossMotorIsFoundAtItsSlip) {
  const PullOut found = pull_out(test::kloss(50, 0.2, 180, 60), 180, 60);
  EXPECT_NEAR(found.torque_Nm, 50, 1e-9);
  EXPECT_NEAR(found.slip, 0.2, 1e-5);
}

TEST(Feasibility, PullOutOfTheCircuitMatchesTheClosedForm) {
  MotorConfig m;
  const double w = 2 * kPi * 60;
  const double X = w * m.L_l_H;
  const double Xm = w * m.L_m_H;
  // Thevenin circuit seen from R_r / s.
  const std::complex<double> z_s(m.R_s_ohm, X);
  const std::complex<double> j_xm(0, Xm);
  const std::complex<double> z_t = z_s * j_xm / (z_s + j_xm);
  const double v_t = std::abs(180.0 * j_xm / (z_s + j_xm));
  const double expected = 1.5 * m.pole_pairs / w * v_t * v_t / (2 * (z_t.real() + std::abs(z_t)));
  EXPECT_NEAR(pull_out(test::circuit(m), 180, 60).torque_Nm, expected, 1e-6 * expected);
}

TEST(Feasibility, MostIsTheMarginUnderPullOutLessFriction) {
  RigConfig rig = wide_rig();
  const CheckedPoint free = check(at(60, 100, "load_share = 1.0"), rig, fifty_Nm(rig));
  EXPECT_TRUE(free.feasible) << free.why;
  EXPECT_NEAR(free.load_Nm, 0.75 * 50, 1e-6);
  EXPECT_EQ(free.most_by, "pull-out");
  // 0.75 = 2 x / (1 + x^2) gives x = (1 - sqrt(1 - 0.75^2)) / 0.75
  EXPECT_NEAR(free.slip, 0.2 * (1 - std::sqrt(1 - 0.5625)) / 0.75, 1e-6);
  EXPECT_NEAR(free.speed_rpm, 1800 * (1 - free.slip), 1e-6);

  rig.motor.friction_Nm = 2.0;
  const CheckedPoint rubbed = check(at(60, 100, "load_share = 1.0"), rig, fifty_Nm(rig));
  EXPECT_NEAR(rubbed.torque_Nm, 37.5, 1e-6);
  EXPECT_NEAR(rubbed.load_Nm, 37.5 - 2.0 * rubbed.speed_rpm / rig.motor.rated_speed_rpm, 1e-6);
}

TEST(Feasibility, PullOutFallsWithTheSquareOfFlux) {
  const RigConfig rig = wide_rig();
  EXPECT_NEAR(check(at(60, 50, ""), rig, fifty_Nm(rig)).pull_out_Nm, 50.0 / 4, 1e-9);
  EXPECT_NEAR(check(at(80, 100, ""), rig, fifty_Nm(rig)).pull_out_Nm, 50.0 * 9 / 16, 1e-9);
}

TEST(Feasibility, CurrentLimitBoundsTheLoad) {
  RigConfig rig = wide_rig();
  const CheckedPoint p =
      check(at(60, 100, "load_share = 1.0\nstep_percent = 1e-6"), rig, fifty_Nm(rig), "current_A = 5\n");
  EXPECT_EQ(p.most_by, "current");
  EXPECT_NEAR(p.slip, 0.05, 1e-6);  // 100 A * slip = 5 A
  EXPECT_NEAR(p.load_Nm, 50 * 2 / (0.05 / 0.2 + 0.2 / 0.05), 1e-4);
}

TEST(Feasibility, StepsTransientCountsAgainstTheCurrentLimit) {
  RigConfig rig = wide_rig();
  rig.motor.L_l_H = 0.006;
  const CheckedPoint p = check(at(60, 100, "step_percent = 10"), rig, fifty_Nm(rig));
  const double Z = std::hypot(0.39 + 0.22, 2 * kPi * 60 * 0.006);
  const double alone = 0.1 * rated_peak_V(rig.motor) / Z;
  EXPECT_GT(p.current_peak_A - p.current_A, alone);
  EXPECT_LT(p.current_peak_A - p.current_A, 2 * alone);
}

TEST(Feasibility, SlipLimitBoundsTheLoad) {
  const RigConfig rig = wide_rig();
  const Plan plan =
      parse_plan("version = 1\nname = \"p\"\n[limits]\nslip = 0.03\n" + at(60, 100, "load_share = 1.0"), "p");
  const CheckedPoint p = check_points(plan, rig, fifty_Nm(rig)).front();
  EXPECT_EQ(p.most_by, "slip");
  EXPECT_NEAR(p.slip, 0.03, 1e-6);
}

TEST(Feasibility, GeneratorBoundsTheLoadAndItsExcitationGivesIt) {
  RigConfig rig = wide_rig();
  rig.generator.R_field_ohm = 20;
  rig.dyno.max_V = 20;  // one ampere
  const CheckedPoint p = check(at(60, 100, "load_share = 1.0"), rig, fifty_Nm(rig));
  EXPECT_EQ(p.most_by, "generator");
  EXPECT_NEAR(p.excitation_A, 1.0, 1e-6);
  const double w = 2 * 2 * kPi * p.speed_rpm / 60;
  const GeneratorConfig& g = rig.generator;
  const double R = g.R_a_ohm + g.R_load_ohm;
  const double E = w * g.flux_per_field_A_Wb;
  EXPECT_NEAR(p.load_Nm, 1.5 * 2 * E * E * R / (w * (R * R + w * w * g.L_s_H * g.L_s_H)), 1e-6);
}

TEST(Feasibility, NoLoadTorqueAbovePullOutIsToldAtLowVoltsPerHertz) {
  RigConfig rig = wide_rig();
  rig.motor.friction_Nm = 1.0;
  const CheckedPoint p = check(at(80, 10, ""), rig, fifty_Nm(rig));  // pull-out 0.28 N m
  EXPECT_FALSE(p.feasible);
  EXPECT_THAT(p.why, HasSubstr("no-load torque"));
}

TEST(Feasibility, StepAboveTheInverterIsTold) {
  RigConfig rig = wide_rig();
  rig.limits.voltage_V = 190;
  EXPECT_TRUE(check(at(60, 100, "step_percent = 5"), rig, fifty_Nm(rig)).feasible);
  const CheckedPoint p = check(at(60, 100, "step_percent = 10"), rig, fifty_Nm(rig));
  EXPECT_FALSE(p.feasible);
  EXPECT_THAT(p.why, HasSubstr("inverter"));
}

TEST(Feasibility, SpeedLimitIsTold) {
  RigConfig rig = wide_rig();
  rig.limits.speed_rpm = 2000;
  EXPECT_TRUE(check(at(60, 100, ""), rig, fifty_Nm(rig)).feasible);
  EXPECT_THAT(check(at(80, 100, ""), rig, fifty_Nm(rig)).why, HasSubstr("speed"));
}

TEST(Feasibility, TorqueAboveTheMostIsToldWithItsBound) {
  const RigConfig rig = wide_rig();
  const CheckedPoint p = check(at(60, 100, "load_Nm = 40"), rig, fifty_Nm(rig));
  EXPECT_FALSE(p.feasible);
  EXPECT_THAT(p.why, HasSubstr("pull-out"));
  EXPECT_THAT(p.why, HasSubstr("37.5"));
}

TEST(Feasibility, CurrentsAtRestAreCheckedToo) {
  RigConfig rig;
  rig.limits.current_A = 10;
  const auto points =
      check_points(parse_plan("version = 1\nname = \"p\"\n[dc]\nlevels_A = [5, 20]\n[standstill]\n", "p"),
                   rig, fifty_Nm(rig));
  EXPECT_TRUE(points[0].feasible);
  EXPECT_THAT(points[1].why, HasSubstr("20 A"));
  EXPECT_FALSE(points[2].feasible);  // 3 + 4 + 6 A
}

TEST(Feasibility, DirectStartIsToldByItsInrush) {
  RigConfig rig;
  const auto points = check_points(
      parse_plan(
          "version = 1\nname = \"p\"\n[startup]\nfrequencies_Hz = [60]\nvoltages_percent = [20, 100]\n", "p"),
      rig, test::circuit(rig.motor));
  EXPECT_TRUE(points[0].feasible) << points[0].why;
  EXPECT_FALSE(points[1].feasible);
  EXPECT_GT(points[1].current_peak_A, rated_peak_V(rig.motor) / (2 * kPi * 60 * rig.motor.L_l_H) * 0.9);
}

TEST(Feasibility, VoltsPerHertzBeyondThePlansLimitAreLeftOut) {
  RigConfig rig;
  const auto points =
      check_points(parse_plan("version = 1\nname = \"p\"\n[limits]\nflux_percent = 110\n[no_load]\n"
                              "frequencies_Hz = [30, 60]\nvoltages_percent = [50, 100]\n",
                              "p"),
                   rig, test::circuit(rig.motor));
  ASSERT_EQ(points.size(), 4u);
  EXPECT_TRUE(points[0].feasible) << points[0].why;   // 30 Hz, 50 %
  EXPECT_FALSE(points[1].feasible);                   // 30 Hz, 100 %: twice rated
  EXPECT_NE(points[1].why.find("200 %"), std::string::npos) << points[1].why;
  EXPECT_TRUE(points[3].feasible) << points[3].why;   // 60 Hz, 100 %
}

TEST(Feasibility, ARegulatedSweepMakesNoTorqueSoFrictionDoesNotBoundItsCurrent) {
  RigConfig rig;
  const std::string head = "version = 1\nname = \"p\"\n[locked_sweep]\nfrequencies_Hz = [5]\ncurrent_A = 6\n";
  const auto turning = check_points(parse_plan(head, "p"), rig, test::circuit(rig.motor));
  const auto regulated = check_points(parse_plan(head + "regulated = true\n", "p"), rig, test::circuit(rig.motor));
  EXPECT_FALSE(turning[0].feasible);
  EXPECT_TRUE(regulated[0].feasible) << regulated[0].why;
}

TEST(Feasibility, EveryFeasiblePointOfThePaperGridKeepsEveryLimit) {
  RigConfig rig;
  rig.motor.friction_Nm = 0.5;
  const Plan plan = load_plan(std::string(IMRIG_SOURCE_DIR) + "/campaigns/proca_grid.toml");
  int feasible = 0;
  for (const CheckedPoint& p : check_points(plan, rig, test::circuit(rig.motor))) {
    if (p.point.kind != PointKind::kStep) continue;
    if (!p.feasible) {
      EXPECT_FALSE(p.why.empty());
      continue;
    }
    ++feasible;
    EXPECT_LE(p.torque_Nm, 0.75 * p.pull_out_Nm * (1 + 1e-9)) << p.point.id;
    EXPECT_LE(p.current_peak_A, 0.85 * rig.limits.current_A * (1 + 1e-9)) << p.point.id;
    EXPECT_LE(p.excitation_A, most_field_A(rig.generator, rig.dyno) * (1 + 1e-9)) << p.point.id;
    EXPECT_GE(p.load_Nm, 0.0);
  }
  EXPECT_GT(feasible, 290);  // what the paper took on its own motor
  EXPECT_LT(feasible, 480);
}

}  // namespace
}  // namespace imrig
