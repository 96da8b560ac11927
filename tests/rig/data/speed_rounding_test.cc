#include "rig/data/speed_rounding.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "rig/base/space_vector.h"

namespace imrig {
namespace {

constexpr double kRpm = 2.0 * kPi / 60.0;

using Shown = std::function<double(double true_rpm)>;

double rounded(double rpm) { return std::round(rpm); }
double as_it_is(double rpm) { return rpm; }

// Eight runs of 0.8 s that slow down by 20 rpm and stay there.
DataSet runs(double noise_rpm, const Shown& shown, double sample_s = 200e-6) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal(0.0, 1.0);
  DataSet data;
  for (int n = 0; n < 8; ++n) {
    Record r;
    r.series.sample_time_s = sample_s;
    for (int k = 0; k < static_cast<int>(0.8 / sample_s); ++k) {
      const double settling = 1.0 - std::exp(-k * sample_s / 0.08);
      const double rpm = 1437.3 + 1.37 * n - 20.0 * settling + noise_rpm * normal(random);
      r.series.speed_rad_s.push_back(shown(rpm) * kRpm);
    }
    data.records.push_back(std::move(r));
  }
  return data;
}

// Speeds that never move.
DataSet held(const std::vector<double>& rpm) {
  DataSet data;
  for (const double n : rpm) {
    Record r;
    r.series.sample_time_s = 200e-6;
    r.series.speed_rad_s.assign(2000, n * kRpm);
    data.records.push_back(std::move(r));
  }
  return data;
}

double step_of(const DataSet& data) { return speed_rounding(data).step_rad_s; }

TEST(SpeedRounding, AWholeNumberOfTurnsAMinuteIsSeen) {
  const SpeedRounding found = speed_rounding(runs(0.02, rounded));
  EXPECT_NEAR(found.step_rad_s, kRpm, 1e-9);
  EXPECT_NEAR(found.sigma_rad_s, kRpm / std::sqrt(12.0), 0.1 * kRpm) << "of a uniform share of a step";
  EXPECT_EQ(found.of_record, std::vector<bool>(8, true));
}

TEST(SpeedRounding, SoIsAnyDecimalOfAnyUnit) {
  EXPECT_NEAR(step_of(runs(0.3, [](double rpm) { return 5.0 * std::round(rpm / 5.0); })), 5.0 * kRpm, 1e-9);
  EXPECT_NEAR(step_of(runs(0.02, [](double rpm) { return std::round(10.0 * rpm) / 10.0; })), 0.1 * kRpm,
              1e-9);
  EXPECT_NEAR(step_of(runs(0.1, [](double rpm) { return std::round(rpm * kRpm * 10.0) / 10.0 / kRpm; })), 0.1,
              1e-9);
}

TEST(SpeedRounding, WhatFilesRoundBesideIsNoOtherGrid) {
  for (const double digits : {1e3, 1e4, 1e5, 1e6}) {
    DataSet data = runs(0.1, rounded);
    for (Record& r : data.records) {
      for (double& w : r.series.speed_rad_s) w = std::round(w * digits) / digits;
    }
    EXPECT_NEAR(step_of(data), kRpm, 1e-9) << digits;
  }
}

TEST(SpeedRounding, AFewCellsThatWereFilledAndARecordOfAnotherChannelDoNotHideIt) {
  DataSet data = runs(0.1, rounded);
  data.records[2].series.speed_rad_s[1000] += 0.37 * kRpm;
  data.records[3].series.speed_rad_s[1000] += 0.5 * kRpm;
  data.records[5] = runs(0.1, as_it_is).records[5];
  const SpeedRounding found = speed_rounding(data);
  EXPECT_NEAR(found.step_rad_s, kRpm, 1e-9);
  EXPECT_FALSE(found.of_record[5]);
  EXPECT_TRUE(found.of_record[2]);
}

TEST(SpeedRounding, NoiseThatCarriesItAcrossTheStepsMendsIt) {
  const double free = speed_rounding(runs(0.05, rounded)).sigma_rad_s,
               less = speed_rounding(runs(0.2, rounded)).sigma_rad_s;
  EXPECT_GT(less, 0.08 * kRpm);
  EXPECT_LT(less, 0.75 * free);
  EXPECT_EQ(step_of(runs(0.6, rounded)), 0.0);
}

TEST(SpeedRounding, ASmoothSpeedHasNone) { EXPECT_EQ(step_of(runs(0.1, as_it_is)), 0.0); }

TEST(SpeedRounding, ReadingsOfADisplayNeverMoveAndLieOnAnyTurn) {
  EXPECT_NEAR(step_of(held({1499.0, 1496.0, 1493.0, 1490.0, 1486.0})), kRpm, 1e-9);
}

TEST(SpeedRounding, SetPointsAreExact) {
  EXPECT_LT(step_of(held({1490.2, 1480.1, 1470.33, 1460.7, 1450.9})), 0.11 * kRpm) << "read to a tenth";
  EXPECT_EQ(step_of(held({1490.0, 1480.0, 1470.0, 1460.0, 1450.0})), 0.0);
  EXPECT_EQ(step_of(held({1492.5, 1485.0, 1477.5, 1470.0, 1455.0})), 0.0);
  EXPECT_EQ(step_of(held({1782.0, 1764.0, 1746.0, 1728.0, 1710.0})), 0.0);
  EXPECT_EQ(step_of(held({1500.0, 1500.0, 1470.0})), 0.0);
}

// Lines that passed since the last count: too many or too few now, the other way round soon.
TEST(SpeedRounding, CountsOfAnEncoderAreNone) {
  for (const double lines : {1024.0, 1500.0}) {  // of the latter a count over 10 ms is 1 rpm
    for (const double over_s : {2e-3, 5e-3, 10e-3, 20e-3}) {
      for (const double sample_s : {50e-6, 200e-6}) {
        const double per_count = 60.0 / (lines * 4.0 * over_s);  // rpm
        const auto samples = static_cast<int>(std::lround(over_s / sample_s));
        double angle = 0.0, last = 0.0, counted = 0.0;
        int n = 0;
        const auto count = [&](double rpm) {
          angle += rpm / per_count / samples;
          if (++n % samples == 0) counted = std::floor(angle) - last, last = std::floor(angle);
          return counted * per_count;
        };
        EXPECT_EQ(step_of(runs(0.0, count, sample_s)), 0.0) << lines << " " << over_s << " " << sample_s;
      }
    }
  }
}

TEST(SpeedRounding, AShaftAtRestHasNothingToRound) {
  DataSet data = runs(0.1, as_it_is);
  for (int n = 0; n < 20; ++n) {
    Record locked;
    locked.series.speed_rad_s.assign(4000, 0.0);
    data.records.push_back(locked);
  }
  EXPECT_EQ(step_of(data), 0.0);
  EXPECT_EQ(step_of({}), 0.0);
}

}  // namespace
}  // namespace imrig
