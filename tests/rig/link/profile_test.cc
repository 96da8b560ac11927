#include "rig/link/device/profile.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include "rig/base/space_vector.h"
#include "tests/rig/link/device_bench.h"

namespace imrig::test {
namespace {

constexpr double kT = kSample_s;
const imrig_profile_limits kLimits = {230.0, 30.0, kT};

struct Drive {
  Drive() {
    imrig_drive_init(&d, kT, 4);
    d.voltage_limit_V = 230.0;
  }
  imrig_command step() { return *imrig_drive_step(&d, m++, i.data()); }
  SpaceVector vector_step() {
    const imrig_command c = step();
    return space_vector(c.v_V[0], c.v_V[1], c.v_V[2]);
  }
  imrig_drive d = {};
  std::int64_t m = 0;
  std::array<double, 3> i = {};
};

imrig_segment current_segment(std::int64_t samples, double angle_rad, double offset_A) {
  imrig_segment s = {};
  s.kind = IMRIG_CURRENT;
  s.duration_samples = samples;
  s.angle_rad = angle_rad;
  s.offset_A = offset_A;
  s.kp_V_per_A = 1.6;
  s.ki_V_per_As = 116.0;
  s.period_samples = 5;
  return s;
}

imrig_segment dc_segment(std::int64_t samples, int plus, int minus, double level_A, double level_V) {
  imrig_segment s = {};
  s.kind = IMRIG_DC;
  s.duration_samples = samples;
  s.plus_phases = plus;
  s.minus_phases = minus;
  s.level_A = level_A;
  s.level_V = level_V;
  s.kp_V_per_A = s.ki_V_per_As = kNan;
  return s;
}

// ---- checks

TEST(ProfileCheck, TakesWhatIsInRangeAndNamesWhatIsNot) {
  EXPECT_EQ(imrig_segment_check(std::vector{voltage_segment(1, 0, 230, -80, 80)}.data(), &kLimits),
            IMRIG_DONE);
  const auto result = [](imrig_segment s) { return imrig_segment_check(&s, &kLimits); };
  EXPECT_EQ(result(voltage_segment(1, 0, 231, 0, 60)), IMRIG_OVER_LIMIT);
  EXPECT_EQ(result(voltage_segment(1, -1, 0, 0, 60)), IMRIG_MALFORMED);
  EXPECT_EQ(result(voltage_segment(1, kNan, 0, 0, 60)), IMRIG_MALFORMED);
  EXPECT_EQ(result(voltage_segment(1, 0, INFINITY, 0, 60)), IMRIG_OVER_LIMIT);
  EXPECT_EQ(result(voltage_segment(1, 0, 1, 0, 1001)), IMRIG_MALFORMED);
  EXPECT_EQ(result(voltage_segment(1, 0, 1, kNan, 1)), IMRIG_MALFORMED);
  EXPECT_EQ(result(voltage_segment(0, 0, 1, 0, 1)), IMRIG_MALFORMED);
  EXPECT_EQ(result(current_segment(5, 1.57, 30.0)), IMRIG_DONE);
  EXPECT_EQ(result(current_segment(5, 1.57, 30.1)), IMRIG_OVER_LIMIT);
  EXPECT_EQ(result(current_segment(5, kNan, 3)), IMRIG_MALFORMED);
  EXPECT_EQ(result(dc_segment(5, 1, 6, 10, 0)), IMRIG_DONE);
  EXPECT_EQ(result(dc_segment(5, 1, 6, kNan, 230)), IMRIG_DONE);
  EXPECT_EQ(result(dc_segment(5, 1, 6, kNan, -231)), IMRIG_OVER_LIMIT);
  EXPECT_EQ(result(dc_segment(5, 1, 6, kNan, kNan)), IMRIG_MALFORMED);
  EXPECT_EQ(result(dc_segment(5, 3, 6, 1, 0)), IMRIG_MALFORMED);  // phase b on both sides
  EXPECT_EQ(result(dc_segment(5, 0, 6, 1, 0)), IMRIG_MALFORMED);
  EXPECT_EQ(result(dc_segment(5, 8, 1, 1, 0)), IMRIG_MALFORMED);
  imrig_segment odd = off_segment(10);
  odd.kind = 4;
  EXPECT_EQ(result(odd), IMRIG_MALFORMED);
  odd = off_segment(10);
  odd.record = -1;
  EXPECT_EQ(result(odd), IMRIG_MALFORMED);
}

TEST(ProfileCheck, SumsTheTonesAgainstTheCurrentLimit) {
  imrig_segment s = current_segment(100, 0, 10.0);
  s.n_tones = 2;
  s.tone_A[0] = 12.0;
  s.tone_A[1] = -8.0;
  s.tone_Hz[0] = s.tone_Hz[1] = 5.0;
  EXPECT_EQ(imrig_segment_check(&s, &kLimits), IMRIG_DONE);
  s.tone_A[1] = -8.1;
  EXPECT_EQ(imrig_segment_check(&s, &kLimits), IMRIG_OVER_LIMIT);
  s.tone_A[1] = 0.0;
  s.tone_Hz[1] = 1667.0;  // above half the regulator's rate
  EXPECT_EQ(imrig_segment_check(&s, &kLimits), IMRIG_MALFORMED);
  s.n_tones = 9;
  EXPECT_EQ(imrig_segment_check(&s, &kLimits), IMRIG_MALFORMED);
}

// ---- voltage vectors

TEST(VoltageSegment, FollowsTheIntegralOfItsFrequencyRamp) {
  Drive drive;
  const imrig_segment s = voltage_segment(20000, 10, 210, -20, 60);
  imrig_drive_enter(&drive.d, &s);
  const double length = 20000 * kT;
  for (int m = 0; m < 20000; ++m) {
    const SpaceVector v = drive.vector_step();
    const double t = (m - m % 4) * kT;  // held over the PWM cycle
    const double angle = 2 * kPi * (-20 * t + 0.5 * 80 * t * t / length);
    ASSERT_LT(std::abs(v - std::polar(10 + 200 * t / length, angle)), 1e-9) << m;
  }
}

TEST(VoltageSegment, KeepsItsAngleAcrossSegmentsOfAnyKind) {
  Drive drive;
  const imrig_segment first = voltage_segment(1000, 100, 100, 50, 30);
  const imrig_segment second = voltage_segment(1000, 90, 90, 30, -30);
  const imrig_segment pause = off_segment(400);
  const imrig_segment last = voltage_segment(1000, 80, 80, 30, 30);
  imrig_drive_enter(&drive.d, &first);
  for (int k = 0; k < 1000; ++k) drive.step();
  imrig_drive_enter(&drive.d, &second);
  const SpaceVector at_second = drive.vector_step();
  EXPECT_NEAR(std::arg(at_second * std::polar(1.0, -2 * kPi * 40 * 1000 * kT)), 0.0, 1e-9);
  for (int k = 1; k < 1000; ++k) drive.step();
  imrig_drive_enter(&drive.d, &pause);
  for (int k = 0; k < 400; ++k) EXPECT_EQ(drive.step().legs, 0u);
  imrig_drive_enter(&drive.d, &last);  // the second segment's frequency had the mean 0
  EXPECT_NEAR(std::arg(drive.vector_step() / at_second), 0.0, 1e-9);
}

TEST(VoltageSegment, HeldGoesOnWithItsEndValuesForHours) {
  Drive drive;
  const imrig_segment s = voltage_segment(4000, 0, 150, 0, 47.3);
  imrig_drive_enter(&drive.d, &s);
  for (int k = 0; k < 4000; ++k) drive.step();
  imrig_drive_hold(&drive.d);
  const double at_end = 0.5 * 47.3 * 4000 * kT;
  EXPECT_LT(std::abs(drive.vector_step() - std::polar(150.0, 2 * kPi * at_end)), 1e-9);
  const std::int64_t three_hours = 180000000;
  drive.d.n += three_hours;
  drive.m += three_hours;
  for (int k = 1; k < 5; ++k) drive.step();
  const double turns = at_end + 47.3 * kT * static_cast<double>(three_hours + 4);
  const imrig_command c = drive.d.command;
  EXPECT_LT(std::abs(space_vector(c.v_V[0], c.v_V[1], c.v_V[2]) -
                     std::polar(150.0, 2 * kPi * (turns - std::floor(turns)))),
            1e-4);
}

TEST(RampDown, BringsATurningVectorLinearlyToZeroAndThenOpensTheLegs) {
  Drive drive;
  const imrig_segment s = voltage_segment(4000, 120, 120, 50, 50);
  imrig_drive_enter(&drive.d, &s);
  for (int k = 0; k < 2000; ++k) drive.step();
  imrig_drive_ramp_down(&drive.d, 1000);
  for (int k = 0; k < 1000; ++k) {
    EXPECT_FALSE(imrig_drive_ramped(&drive.d));
    const SpaceVector v = drive.vector_step();
    const int held = k - k % 4;
    ASSERT_LT(std::abs(v - std::polar(120.0 * (1.0 - held / 1000.0), 2 * kPi * 50 * (2000 + held) * kT)),
              1e-8);
  }
  EXPECT_TRUE(imrig_drive_ramped(&drive.d));
  EXPECT_EQ(drive.step().legs, 0u);
}

// ---- regulated current

// One axis of a resistance and an inductance, exact for a voltage held over a sample.
struct Load {
  double R_ohm, L_H;
  double i_A = 0.0;
  double a() const { return std::exp(-R_ohm * kT / L_H); }
  double b() const { return (1.0 - a()) / R_ohm; }
  void step(double v) { i_A = a() * i_A + b() * v; }
};

TEST(CurrentSegment, FollowsAMultiSineAsItsClosedLoopPredicts) {
  const double axis = kPi / 2;
  const double tones_Hz[] = {1.9, 12.0, 70.0};
  imrig_segment s = current_segment(1000000, axis, 2.0);
  s.n_tones = 3;
  for (int k = 0; k < 3; ++k) {
    s.tone_A[k] = 3.0 + k;
    s.tone_Hz[k] = tones_Hz[k];
    s.tone_rad[k] = 0.3 * k;
  }
  Drive drive;
  imrig_drive_enter(&drive.d, &s);
  Load load{1.2, 0.02};
  // Sample m-1 shows the current at t_m-1; the voltage of command m acts from t_m on.
  const int n = 10 * 16667;  // 10 s
  std::vector<double> seen_A;
  double acting_V = 0.0;
  for (int m = 0; m < n; ++m) {
    drive.i = phases(std::polar(load.i_A, axis));
    if (m % 5 == 0) seen_A.push_back(load.i_A);
    const SpaceVector v = drive.vector_step();
    load.step(acting_V);                             // t_m-1 .. t_m
    acting_V = (v * std::polar(1.0, -axis)).real();  // t_m ..
    ASSERT_LT(std::abs((v * std::polar(1.0, -axis)).imag()), 1e-9);
  }
  // Lifted to the regulator's period P = 5 samples, with the voltage one sample late: I (z - a^5) = b (a^4 /
  // z + 1 + a + a^2 + a^3) V.
  const double P = 5 * kT;
  const double a = load.a();
  const auto response = [&](double f) {
    const std::complex<double> z = std::polar(1.0, 2 * kPi * f * P);
    const std::complex<double> plant =
        load.b() * (std::pow(a, 4) / z + 1.0 + a + a * a + a * a * a) / (z - std::pow(a, 5));
    const std::complex<double> open = plant * (1.6 + 116.0 * P / (z - 1.0));
    return open / (1.0 + open);
  };
  const std::size_t settled = seen_A.size() / 2;
  for (std::size_t k = settled; k < seen_A.size(); ++k) {
    const double t = static_cast<double>(k) * P;  // the reference of command 5k
    double expected = 2.0;
    for (int tone = 0; tone < 3; ++tone) {
      const auto h = response(tones_Hz[tone]);
      expected += std::imag((3.0 + tone) * h * std::polar(1.0, 2 * kPi * tones_Hz[tone] * t + 0.3 * tone));
    }
    ASSERT_NEAR(seen_A[k], expected, 1e-6) << k;
  }
}

TEST(CurrentSegment, WithNoGainsGivenHasThePublishedOnes) {
  imrig_segment given = current_segment(1000, 0.0, 5.0);
  imrig_segment asked = given;
  asked.kp_V_per_A = asked.ki_V_per_As = kNan;
  asked.period_samples = 0;
  Drive a, b;
  imrig_drive_enter(&a.d, &given);
  imrig_drive_enter(&b.d, &asked);
  for (int k = 0; k < 50; ++k) {
    a.i = b.i = {0.1 * k, -0.05 * k, -0.05 * k};
    EXPECT_EQ(a.step().v_V[0], b.step().v_V[0]);
  }
}

TEST(CurrentSegment, OfTheSameAxisKeepsTheIntegralAndOfAnotherDoesNot) {
  const imrig_segment first = current_segment(1000, 0.0, 5.0), same = current_segment(10, 0.0, 0.0),
                      turned = current_segment(10, 1.0, 0.0);
  Drive drive;
  imrig_drive_enter(&drive.d, &first);
  for (int k = 0; k < 1000; ++k) drive.step();
  const double integral = drive.d.regulator.integral_V;
  EXPECT_NEAR(integral, 200 * 116.0 * 300e-6 * 5.0, 1e-9);
  imrig_drive_enter(&drive.d, &same);
  EXPECT_NEAR(drive.vector_step().real(), integral, 1e-9);
  imrig_drive_enter(&drive.d, &turned);
  EXPECT_NEAR(std::abs(drive.vector_step()), 0.0, 1e-12);
}

TEST(Regulator, DoesNotWindUpAtItsLimit) {
  imrig_regulator r = {1.6, 116.0, 300e-6, 50.0, 0.0};
  for (int k = 0; k < 10000; ++k) EXPECT_EQ(imrig_regulator_step(&r, 100.0, 0.0), 50.0);
  EXPECT_LE(r.integral_V, 50.0);
  for (int k = 0; k < 10000; ++k) EXPECT_EQ(imrig_regulator_step(&r, -100.0, 0.0), -50.0);
  EXPECT_GE(r.integral_V, -50.0);
  EXPECT_LT(std::abs(imrig_regulator_step(&r, 0.0, 0.0)), 50.0);  // back in range at once
}

// ---- DC

TEST(DcSegment, PutsHalfTheVoltageOnEitherSideAndLeavesTheRestOpen) {
  const imrig_segment s = dc_segment(100, 1, 2, kNan, 12.0);
  Drive drive;
  imrig_drive_enter(&drive.d, &s);
  const imrig_command c = drive.step();
  EXPECT_EQ(c.legs, 3u);
  EXPECT_EQ(c.v_V[0], 6.0);
  EXPECT_EQ(c.v_V[1], -6.0);
  EXPECT_EQ(c.v_V[2], 0.0);
}

TEST(DcSegment, HoldsTheCurrentOutOfTheMinusSide) {
  // a against b and c together: R + R/2 in series, as in the DC test of a star.
  const imrig_segment s = dc_segment(100000, 1, 6, 8.0, 0.0);
  Drive drive;
  imrig_drive_enter(&drive.d, &s);
  Load load{1.5 * 0.39, 1.5 * 0.006};
  for (int m = 0; m < 100000; ++m) {
    drive.i = {load.i_A, -0.5 * load.i_A, -0.5 * load.i_A};
    const imrig_command c = drive.step();
    EXPECT_EQ(c.legs, 7u);
    load.step(c.v_V[0] - c.v_V[1]);
  }
  EXPECT_NEAR(load.i_A, 8.0, 1e-9);
  EXPECT_NEAR(drive.d.command.v_V[0] - drive.d.command.v_V[2], 8.0 * 1.5 * 0.39, 1e-9);
}

}  // namespace
}  // namespace imrig::test
