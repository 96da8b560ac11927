#include "rig/data/speed_rounding.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "rig/base/space_vector.h"

namespace imrig {
namespace {

constexpr double kRpm = 2.0 * kPi / 60.0;

// Eight runs of 4000 samples that slow down by 20 rpm and stay there.
DataSet runs(double noise_rpm, const std::function<double(double true_rpm, double& before)>& shown) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal(0.0, 1.0);
  DataSet data;
  for (int n = 0; n < 8; ++n) {
    Record r;
    double before = 0.0;
    for (int k = 0; k < 4000; ++k) {
      const double rpm = 1437.3 + 1.37 * n - 20.0 * (1.0 - std::exp(-k / 400.0)) + noise_rpm * normal(random);
      r.series.speed_rad_s.push_back(shown(rpm, before) * kRpm);
    }
    data.records.push_back(std::move(r));
  }
  return data;
}

double rounded(double rpm, double&) { return std::round(rpm); }

TEST(SpeedRounding, AWholeNumberOfTurnsAMinuteIsSeen) {
  EXPECT_NEAR(rounded_speed_step(runs(0.1, rounded)), kRpm, 1e-9);
}

TEST(SpeedRounding, WhatFilesRoundBesideIsNoOtherGrid) {
  DataSet data = runs(0.1, rounded);
  for (Record& r : data.records) {
    for (double& w : r.series.speed_rad_s) w = std::round(w * 1e6) * 1e-6;
  }
  EXPECT_NEAR(rounded_speed_step(data), kRpm, 1e-5);
}

TEST(SpeedRounding, NoiseThatCarriesItAcrossTheStepsMendsIt) {
  EXPECT_EQ(rounded_speed_step(runs(0.6, rounded)), 0.0);
}

TEST(SpeedRounding, ASmoothSpeedHasNone) {
  EXPECT_EQ(rounded_speed_step(runs(0.1, [](double rpm, double&) { return rpm; })), 0.0);
}

// Lines that passed since the last sample: too many or too few now, the other way round soon.
TEST(SpeedRounding, CountsOfAnEncoderAreNone) {
  const double per_count = 60.0 / (4096 * 4 * 2e-3);  // rpm, over 2 ms
  EXPECT_EQ(rounded_speed_step(runs(0.0,
                                    [=](double rpm, double& angle) {
                                      const double before = std::floor(angle);
                                      angle += rpm / per_count;
                                      return (std::floor(angle) - before) * per_count;
                                    })),
            0.0);
}

TEST(SpeedRounding, AShaftAtRestHasNothingToRound) {
  DataSet data = runs(0.1, [](double rpm, double&) { return rpm; });
  for (int n = 0; n < 20; ++n) {
    Record locked;
    locked.series.speed_rad_s.assign(4000, 0.0);
    data.records.push_back(locked);
  }
  EXPECT_EQ(rounded_speed_step(data), 0.0);
  EXPECT_EQ(rounded_speed_step({}), 0.0);
}

}  // namespace
}  // namespace imrig
