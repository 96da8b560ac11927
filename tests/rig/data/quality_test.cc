#include "rig/data/quality.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "rig/data/folder.h"
#include "tests/rig/data/scratch.h"

namespace imrig {
namespace {

using test::Bench;
using test::has;
using test::kOneRecord;
using test::manifest;
using test::Scratch;

template <class Change>
std::vector<std::string> warnings(const Bench& bench, Change&& change, const std::string& kind = "steady") {
  Scratch folder;
  folder.write("dataset.toml",
               manifest("[[record]]\nid = \"r1\"\nkind = \"" + kind + "\"\nfile = \"r1.csv\"\n"));
  folder.write("r1.csv", bench.csv([&](int k, std::vector<double>& x) {
    change(k, x);
    return true;
  }));
  return read_folder(folder.path()).records.at(0).warnings;
}

std::string listed(const std::vector<std::string>& all) {
  std::string text;
  for (const auto& one : all) text += one + "\n";
  return text;
}

#define EXPECT_SAID(list, part) EXPECT_TRUE(has(list, part)) << listed(list)

const auto kNothing = [](int, std::vector<double>&) {};

TEST(Quality, CleanQuantisedNoisyAndBackwardRunningDataEarnNoWarning) {
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0.0, 0.05);
  EXPECT_TRUE(warnings(Bench(), kNothing).empty());
  const auto quantised = warnings(Bench(), [](int, std::vector<double>& x) {
    for (std::size_t k = 1; k < 7; ++k) x[k] = std::round(x[k] / 0.2) * 0.2;
  });
  EXPECT_TRUE(quantised.empty()) << listed(quantised);
  const auto noisy = warnings(Bench(), [&](int, std::vector<double>& x) {
    for (std::size_t k = 1; k < 7; ++k) x[k] += noise(random);
  });
  EXPECT_TRUE(noisy.empty()) << listed(noisy);
  Bench backward;
  backward.f_Hz = -50.0;
  backward.lag = -backward.lag;
  backward.speed_rpm = -1455.0;
  EXPECT_TRUE(warnings(backward, kNothing).empty()) << listed(warnings(backward, kNothing));
}

TEST(Quality, SwappedCurrentPhasesAreFound) {
  const auto said = warnings(Bench(), [](int, std::vector<double>& x) { std::swap(x[5], x[6]); });
  EXPECT_SAID(
      said,
      "voltage turns a-b-c at 50 Hz but the current turns a-c-b: two phases of one of them are swapped");
}

TEST(Quality, PhasesSwappedInBothContradictTheSpeed) {
  const auto said = warnings(Bench(), [](int, std::vector<double>& x) {
    std::swap(x[5], x[6]);
    std::swap(x[2], x[3]);
  });
  EXPECT_SAID(said, "its sign or the phase order is reversed");
}

TEST(Quality, ShiftedPhasesAndReversedSensorsAreFound) {
  const auto left = warnings(
      Bench(), [](int, std::vector<double>& x) { std::rotate(x.begin() + 4, x.begin() + 5, x.begin() + 7); });
  EXPECT_SAID(left,
              "power flows out of the motor (the current lags by 150 degrees) although the slip is 3 %");
  const auto right = warnings(
      Bench(), [](int, std::vector<double>& x) { std::rotate(x.begin() + 4, x.begin() + 6, x.begin() + 7); });
  EXPECT_SAID(right, "the current leads the voltage by 90 degrees");
  const auto all = warnings(Bench(), [](int, std::vector<double>& x) {
    for (std::size_t k = 4; k < 7; ++k) x[k] = -x[k];
  });
  EXPECT_SAID(all, "the current leads the voltage by 150 degrees");
  const auto one = warnings(Bench(), [](int, std::vector<double>& x) { x[4] = -x[4]; });
  EXPECT_SAID(one, "opposite sequence");
  EXPECT_SAID(one, "do not sum to zero");
}

TEST(Quality, ClippedCurrentsAreFound) {
  const auto said = warnings(Bench(), [](int, std::vector<double>& x) {
    for (std::size_t k = 4; k < 7; ++k) x[k] = std::clamp(x[k], -9.0, 9.0);
  });
  EXPECT_SAID(said, "i_a sits at its largest value 9 in");
  EXPECT_SAID(said, "clipped?");
}

// An inverter's voltage is constant within a switching cycle: 36 cycles a period, four samples each.
TEST(Quality, VoltagesHeldForASwitchingCycleAreNotClipped) {
  Bench bench;
  bench.sample_time_s = 1.0 / (50.0 * 36.0 * 4.0);
  const auto said = warnings(bench, [&](int k, std::vector<double>& x) {
    const auto held = bench.row(k - k % 4);
    for (std::size_t c = 1; c < 4; ++c) x[c] = held[c];
  });
  EXPECT_TRUE(said.empty()) << listed(said);
}

TEST(Quality, SpeedUnitsAreToldApart) {
  const auto with_speed = [](double speed) {
    Bench bench;
    bench.speed_rpm = speed;
    return warnings(bench, kNothing);
  };
  EXPECT_SAID(with_speed(1455.0 * 2.0 * kPi / 60.0), "the column seems to hold rad/s, not rpm");
  EXPECT_SAID(with_speed(1455.0 / 60.0), "turns per second");
  EXPECT_SAID(with_speed(-1455.0), "its sign or the phase order is reversed");
  EXPECT_SAID(with_speed(2910.0), "it would fit 1 pole pair, or the column holds the electrical speed");
  EXPECT_SAID(with_speed(970.0), "3 pole pairs would fit");
  EXPECT_SAID(with_speed(0.0), "slip of 100 %");
  EXPECT_TRUE(with_speed(1530.0).empty()) << "a generator runs a little above synchronous";
}

// 1024 lines counted over 5 ms: 11.7 rpm a count.
TEST(Quality, SpeedThatMovesInStepsIsDoubted) {
  const auto with_step = [](double step_rpm) {
    return warnings(Bench(), [=](int k, std::vector<double>& x) {
      x[7] = step_rpm * std::round((x[7] + 9.0 * std::sin(0.05 * k)) / step_rpm);
    });
  };
  EXPECT_SAID(with_step(60.0 / 1024.0 / 5e-3), "speed moves in steps of 11.7 rpm");
  EXPECT_SAID(with_step(60.0 / 1024.0 / 5e-3), "a slip of 0.39 %");
  EXPECT_TRUE(
      warnings(Bench(), [](int k, std::vector<double>& x) { x[7] = k < 1000 ? 1450.0 : 1460.0; }).empty())
      << "two set-points are no steps";
  EXPECT_SAID(with_step(1.0), "a slip of 0.033 %");  // 1 % of rated slip, and as much of R_r
  EXPECT_TRUE(with_step(0.2).empty()) << "a tenth of a turn a minute is a slip of 0.007 %";
}

TEST(Quality, MilliampsAndKilovoltsAreFound) {
  EXPECT_SAID(warnings(Bench(),
                       [](int, std::vector<double>& x) {
                         for (std::size_t k = 4; k < 7; ++k) x[k] *= 1000.0;
                       }),
              "currents in mA");
  EXPECT_SAID(warnings(Bench(),
                       [](int, std::vector<double>& x) {
                         for (std::size_t k = 4; k < 7; ++k) x[k] *= 100.0;  // of a tenth of the size
                       }),
              "kVA: a very large motor, or currents in mA?");
  EXPECT_SAID(warnings(Bench(),
                       [](int, std::vector<double>& x) {
                         for (std::size_t k = 1; k < 4; ++k) x[k] /= 1000.0;
                       }),
              "voltages in kV?");
}

TEST(Quality, DeadChannelsAreFound) {
  EXPECT_SAID(warnings(Bench(),
                       [](int, std::vector<double>& x) {
                         for (std::size_t k = 4; k < 7; ++k) x[k] = 0.0;
                       }),
              "current is zero throughout");
  EXPECT_SAID(warnings(Bench(),
                       [](int, std::vector<double>& x) {
                         for (std::size_t k = 1; k < 4; ++k) x[k] = 0.0;
                       }),
              "voltage is zero throughout");
}

std::vector<std::string> point_warnings(const std::string& table, const std::string& quantities = "line") {
  Scratch folder;
  folder.write("dataset.toml",
               manifest("[[record]]\nid = \"p\"\nkind = \"points\"\nfile = \"p.csv\"\n", "star", quantities));
  folder.write("p.csv", table);
  return read_folder(folder.path()).records.at(0).warnings;
}

TEST(Quality, TablesAreCheckedPointByPoint) {
  const std::string head = "v_rms_V,f_Hz,i_rms_A,p_in_W,power_factor,speed_rpm,p_out_W\n";
  EXPECT_TRUE(point_warnings(head + "400,50,20,12000,0.866,1455,10500\n").empty());
  EXPECT_SAID(point_warnings(head + "400,50,20,12000,0.866,152.4,10500\n"), "rad/s");
  EXPECT_SAID(point_warnings(head + "230,50,20,12000,0.866,1455,10500\n"), "line and phase values mixed up");
  EXPECT_SAID(point_warnings(head + "400,50,20,12000,0.866,1455,10500\n", "phase"),
              "line and phase values mixed up");
  EXPECT_SAID(point_warnings(head + "400,50,20,12000,0.866,1455,13000\n"), "more than the 12000 W taken in");
  EXPECT_SAID(point_warnings(head + "400,50,20,12000,0.866,1455,\n400,50,,12000,0.866,1455,\n"),
              "the current column misses 1 of 2 values");
  EXPECT_SAID(point_warnings(head + "400,50,20,12000,0.866,1455,\n400,50,20,12000,0.866,,\n"),
              "1 of 2 points left out");
}

TEST(Quality, LookingTwiceSaysNothingTwice) {
  Scratch folder;
  Bench bench;
  bench.speed_rpm = 970.0;
  folder.write("dataset.toml", manifest(kOneRecord));
  folder.write("r1.csv", bench.csv());
  DataSet data = read_folder(folder.path());
  const auto before = data.records[0].warnings;
  ASSERT_FALSE(before.empty());
  add_quality_warnings(data);
  EXPECT_EQ(data.records[0].warnings, before);
}

}  // namespace
}  // namespace imrig
