#include "rig/data/uniform.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/rig/data/scratch.h"

namespace imrig {
namespace {

using test::has;

std::vector<double> even(std::size_t n, double dt) {
  std::vector<double> t(n);
  for (std::size_t k = 0; k < n; ++k) t[k] = 1.0 + static_cast<double>(k) * dt;
  return t;
}

UniformStretch stretch_of(const std::vector<double>& t) {
  return uniform_stretch(t, std::vector<std::uint8_t>(t.size(), 1));
}

TEST(Uniform, EvenStampsAreTakenAsTheyAre) {
  const auto s = stretch_of(even(1000, 1e-4));
  EXPECT_NEAR(s.sample_time_s, 1e-4, 1e-15);
  EXPECT_EQ(s.begin, 0u);
  EXPECT_EQ(s.end, 1000u);
  EXPECT_FALSE(s.interpolate);
  EXPECT_TRUE(s.warnings.empty());
}

TEST(Uniform, StampsRoundedToAMicrosecondAreNoJitter) {
  auto t = even(5000, 3e-4 + 1.0 / 3.0 * 1e-6);
  for (double& x : t) x = std::round(x * 1e6) * 1e-6;
  const auto s = stretch_of(t);
  EXPECT_FALSE(s.interpolate);
  EXPECT_TRUE(s.warnings.empty());
}

TEST(Uniform, JitterIsInterpolatedAndSaid) {
  auto t = even(2000, 1e-4);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> jitter(-0.2e-4, 0.2e-4);
  for (double& x : t) x += jitter(random);
  const auto s = stretch_of(t);
  ASSERT_TRUE(s.interpolate);
  EXPECT_TRUE(has(s.warnings, "interpolated"));
  std::vector<double> x(t.size());
  for (std::size_t k = 0; k < t.size(); ++k) x[k] = std::sin(2.0 * kPi * 50.0 * t[k]);
  const auto y = take(s, t, x);
  for (std::size_t k = 0; k < y.size(); ++k) {
    EXPECT_NEAR(y[k], std::sin(2.0 * kPi * 50.0 * (t[s.begin] + static_cast<double>(k) * s.sample_time_s)),
                2.5e-4);  // (w dt)^2 / 8 with some margin
  }
}

TEST(Uniform, TheLongestStretchBetweenGapsIsKept) {
  auto t = even(1000, 1e-3);
  t.erase(t.begin() + 200, t.begin() + 260);
  t.erase(t.begin() + 800, t.begin() + 803);
  const auto s = stretch_of(t);
  EXPECT_EQ(s.begin, 200u);
  EXPECT_EQ(s.end, 800u);
  EXPECT_TRUE(has(s.warnings,
                  "2 gaps in time, the longest of 0.061 s after t = 1.199 s; the longest whole stretch is "
                  "kept, 600 of 937"));
}

TEST(Uniform, RowsThatMissValuesEndAStretch) {
  const auto t = even(100, 1e-3);
  std::vector<std::uint8_t> complete(100, 1);
  complete[30] = complete[31] = 0;
  const auto s = uniform_stretch(t, complete);
  EXPECT_EQ(s.begin, 32u);
  EXPECT_EQ(s.end, 100u);
  EXPECT_TRUE(has(s.warnings, "2 of 100 rows miss"));
}

TEST(Uniform, WhatCannotBeUsedIsRefusedWithItsReason) {
  auto back = even(100, 1e-3);
  back[50] = back[49];
  EXPECT_NE(stretch_of(back).reason.find("time stands or goes back at sample 51"), std::string::npos);
  EXPECT_NE(stretch_of(even(10, 1e-3)).reason.find("has 10 samples; at least 16"), std::string::npos);
  auto drifting = even(1000, 1e-3);
  for (std::size_t k = 0; k < 1000; ++k) drifting[k] += 5e-7 * static_cast<double>(k * k) / 100.0;
  EXPECT_NE(stretch_of(drifting).reason.find("not uniform"), std::string::npos);
  std::vector<std::uint8_t> complete(100, 0);
  for (std::size_t k = 0; k < 100; k += 10) complete[k] = 1;
  EXPECT_NE(uniform_stretch(even(100, 1e-3), complete).reason.find("90 of 100 rows"), std::string::npos);
}

}  // namespace
}  // namespace imrig
