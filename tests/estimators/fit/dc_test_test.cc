#include "estimators/fit/dc_test.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

namespace imrig::est {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

constexpr double kR = 0.39;

struct Level {
  SpaceVector current;
  double seconds = 0.3;
};

// Levels of current with the voltage that a machine of R_s = 0.39 ohm shows: resistance, a device drop along
// the current, and what the rotor still adds while its flux settles (R_r i exp(-t/tau)).
TimeSeries levels(const std::vector<Level>& all, double drop_V, double tau_s, double current_noise_A,
                  double voltage_noise_V, SpaceVector zero_v, SpaceVector zero_i, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  TimeSeries s;
  s.sample_time_s = 60e-6;
  int segment = 0;
  const auto noise = [&](double sigma) { return sigma * SpaceVector(normal(random), normal(random)); };
  for (const auto& level : all) {
    const double size = std::abs(level.current);
    for (double t = 0.0; t < level.seconds; t += s.sample_time_s) {
      const SpaceVector rotor = tau_s > 0.0 ? 0.22 * level.current * std::exp(-t / tau_s) : 0.0;
      const SpaceVector drop = size > 0.0 ? drop_V * level.current / size : 0.0;
      s.v.push_back(kR * level.current + drop + rotor + zero_v + noise(voltage_noise_V));
      s.i.push_back(level.current + zero_i + noise(current_noise_A));
      s.speed_rad_s.push_back(0.0);
      s.segment.push_back(segment);
      s.gates_on.push_back(size > 0.0);
      s.stator_C.push_back(31.5);
    }
    ++segment;
  }
  return s;
}

TEST(DcTest, EquationOneOfThePaperInPhaseQuantities) {
  // A and C on plus, B on minus: I_B = 6 A back, I_A = I_C = 3 A; V_AB = (3/2) R_s I_B.
  const double I_B = 6.0, V_AB = 1.5 * kR * I_B;
  TimeSeries s;
  s.sample_time_s = 60e-6;
  for (int k = 0; k < 1000; ++k) {
    s.i.push_back(space_vector(I_B / 2, -I_B, I_B / 2));
    s.v.push_back(space_vector(V_AB / 3, -2 * V_AB / 3, V_AB / 3));
    s.speed_rad_s.push_back(0.0);
  }
  const DcResult r = fit_dc(s);
  ASSERT_EQ(r.failure, "");
  EXPECT_NEAR(r.R_s_ohm, 2.0 / 3.0 * V_AB / I_B, 1e-12);
  ASSERT_EQ(r.levels.size(), 1U);
  EXPECT_NEAR(r.levels[0].current_A, I_B, 1e-12);
}

TEST(DcTest, ChannelZerosComeFromTheStretchWithGatesOff) {
  const auto s = levels({{0.0}, {SpaceVector(-2.0, 3.0)}}, 0.0, 0.0, 0.0, 0.0, {0.7, -0.4}, {0.2, 0.1}, 1);
  EXPECT_NEAR(fit_dc(s).R_s_ohm, kR, 1e-9);
}

TEST(DcTest, SeveralLevelsLeaveTheDeviceDropOut) {
  const auto s = levels({{0.0}, {3.0}, {6.0}, {9.0}}, 0.8, 0.0, 0.02, 0.2, 0.0, 0.0, 2);
  const DcResult r = fit_dc(s);
  ASSERT_EQ(r.failure, "");
  EXPECT_NEAR(r.R_s_ohm, kR, 4.0 * r.sigma_ohm);
  EXPECT_LT(r.sigma_ohm, 0.01 * kR);
  EXPECT_NEAR(r.v_0_V, 0.8, 0.05);
  EXPECT_EQ(r.levels.size(), 3U);
  EXPECT_NEAR(r.stator_C, 31.5, 1e-9);
  EXPECT_THAT(r.notes, IsEmpty());
}

TEST(DcTest, OneLevelSaysThatAnOffsetCannotBeTold) {
  const auto s = levels({{0.0}, {6.0}}, 0.0, 0.0, 0.02, 0.2, 0.0, 0.0, 3);
  EXPECT_THAT(fit_dc(s).notes, testing::Contains(HasSubstr("offset")));
}

TEST(DcTest, LevelsWithoutSegmentsAreFound) {
  auto s = levels({{0.0}, {3.0}, {SpaceVector(0.0, 6.0)}, {9.0}}, 0.0, 0.0, 0.05, 0.2, 0.0, 0.0, 4);
  s.segment.clear();
  s.gates_on.clear();
  const DcResult r = fit_dc(s);
  EXPECT_EQ(r.levels.size(), 3U);
  EXPECT_NEAR(r.R_s_ohm, kR, 4.0 * r.sigma_ohm);
}

TEST(DcTest, SettlingRotorFluxIsWaitedFor) {
  // A second per level, tau 50 ms: the settled end is free of it.
  const auto s = levels({{0.0}, {4.0, 1.0}, {8.0, 1.0}}, 0.0, 0.05, 0.02, 0.1, 0.0, 0.0, 5);
  const DcResult r = fit_dc(s);
  ASSERT_EQ(r.failure, "");
  EXPECT_NEAR(r.R_s_ohm / kR, 1.0, 0.005);
  EXPECT_NEAR(r.R_s_ohm, kR, 3.0 * r.sigma_ohm);
}

TEST(DcTest, ALevelThatNeverSettlesIsRefused) {
  const auto s = levels({{0.0}, {4.0, 0.3}}, 0.0, 0.5, 0.001, 0.005, 0.0, 0.0, 6);
  EXPECT_THAT(fit_dc(s).failure, HasSubstr("no level settles"));
}

// A voltage switched on a winding: the current creeps up as the flux builds, and noise of the voltage hides
// that v/i falls with it.
TEST(DcTest, ACurrentThatStillCreepsIsNotSettledHoweverNoisyTheVoltage) {
  TimeSeries s = levels({{4.0, 0.5}, {9.0, 0.5}}, 0.0, 0.0, 0.03, 0.5, 0.0, 0.0, 4);
  const auto second = static_cast<std::size_t>(0.5 / s.sample_time_s) + 1;
  for (std::size_t k = second; k < s.size(); ++k)
    s.i[k] -= 4.0 * std::exp(-static_cast<double>(k - second) * s.sample_time_s / 0.25);
  const DcResult r = fit_dc(s);
  ASSERT_EQ(r.failure, "");
  ASSERT_EQ(r.levels.size(), 1u);
  EXPECT_NEAR(r.levels[0].current_A, 4.0, 0.01);
  EXPECT_NEAR(r.R_s_ohm, kR, 3.0 * r.sigma_ohm);
}

TEST(DcTest, IntervalsCoverTheTruth) {
  int covered = 0;
  double spread = 0.0, stated = 0.0;
  const int seeds = 100;
  for (int seed = 0; seed < seeds; ++seed) {
    const auto s = levels({{0.0}, {3.0}, {6.0}, {9.0}}, 0.8, 0.0, 0.05, 0.5, {0.1, 0.0}, 0.05,
                          static_cast<std::uint64_t>(100 + seed));
    const DcResult r = fit_dc(s);
    ASSERT_EQ(r.failure, "");
    covered += std::abs(r.R_s_ohm - kR) < 2.0 * r.sigma_ohm;
    spread += (r.R_s_ohm - kR) * (r.R_s_ohm - kR) / seeds;
    stated += r.sigma_ohm / seeds;
  }
  std::printf("dc: spread %.3g, stated %.3g ohm, inside 2 sigma %d/%d\n", std::sqrt(spread), stated, covered,
              seeds);
  EXPECT_GE(covered, 88);
  EXPECT_LT(stated, 2.0 * std::sqrt(spread));
}

TEST(DcTest, WhatIsNoDcRecordIsRefused) {
  auto turning = levels({{0.0}, {6.0}}, 0.0, 0.0, 0.02, 0.2, 0.0, 0.0, 7);
  turning.speed_rad_s.back() = 20.0;
  EXPECT_THAT(fit_dc(turning).failure, HasSubstr("shaft turns"));
  auto wired = levels({{0.0}, {6.0}}, 0.0, 0.0, 0.02, 0.2, 0.0, 0.0, 8);
  for (auto& i : wired.i) i = -i;
  EXPECT_THAT(fit_dc(wired).failure, HasSubstr("polarity"));
  EXPECT_THAT(fit_dc(levels({{0.0}}, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 9)).failure,
              HasSubstr("no direct current"));
  EXPECT_THAT(fit_dc({}).failure, HasSubstr("64"));
}

}  // namespace
}  // namespace imrig::est
