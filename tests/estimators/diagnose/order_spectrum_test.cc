// Lines put into the measured current by hand must come out where they were put, with their size; noise makes
// none.

#include "estimators/diagnose/order_spectrum.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "estimators/diagnose/compare.h"
#include "tests/estimators/diagnose/known_motor.h"

namespace imrig::est {
namespace {

using test::KnownMotor;
using test::SteadyRun;

constexpr double kSlip = 0.04, kf = 50.0;
const double kTurns = kf * (1.0 - kSlip) / 2.0;  // f_r, two pole pairs

// A line of 20 mA at f_Hz in the stationary frame, in noise of 50 mA a sample.
Record with_line(double f_Hz, unsigned seed, double amplitude_A = 0.02) {
  SteadyRun run;
  run.slip = kSlip;
  run.samples = 10000;  // 2 s
  run.sigma_i = 0.05;
  run.seed = seed;
  Record record = test::steady_record(KnownMotor(), fmt::format("r{}", seed), run);
  for (std::size_t k = 0; k < record.series.size(); ++k) {
    const double t = run.sample_time_s * static_cast<double>(k);
    record.series.i[k] += std::polar(amplitude_A, 2.0 * kPi * f_Hz * t + 0.3);
  }
  return record;
}

OrderSpectrum spectrum(std::vector<Record> records, double declared_A = 0.05) {
  DataSet data = test::data_set(std::move(records));
  data.noise.current_A = declared_A;
  return compare(KnownMotor().model(), data).spectrum;
}

struct Case {
  const char* line;
  double f_Hz;
};

TEST(OrderSpectrum, NamesEachLineAndItsSize) {
  const std::vector<Case> cases{{"0", 0.0},
                                {"-f", -kf},
                                {"-5f", -5 * kf},
                                {"7f", 7 * kf},
                                {"(1-2s)f", (1 - 2 * kSlip) * kf},
                                {"(1+2s)f", (1 + 2 * kSlip) * kf},
                                {"f-f_r", kf - kTurns},
                                {"f+f_r", kf + kTurns},
                                {"f+2f_r", kf + 2 * kTurns},
                                {"f-2f_r", kf - 2 * kTurns}};
  for (const Case& c : cases) {
    const OrderSpectrum found = spectrum({with_line(c.f_Hz, 1)});
    ASSERT_EQ(found.lines.size(), line_kinds().size());
    EXPECT_TRUE(found.noise_known);
    for (const OrderLine& line : found.lines) {
      if (line.kind.name == std::string(c.line)) {
        EXPECT_EQ(line.seen, 1u) << c.line;
        EXPECT_NEAR(line.amplitude_A, 0.02, 0.004) << c.line;
        EXPECT_NEAR(line.worst.f_Hz, c.f_Hz, 0.01) << c.line;
      } else {
        EXPECT_EQ(line.seen, 0u) << line.kind.name << " beside " << c.line;
      }
    }
  }
}

// Hann: noise of sigma a component and sample leaves |X| of rms sigma sqrt(2) sqrt(1.5 / n).
TEST(OrderSpectrum, KnowsTheNoiseAtALine) {
  const OrderSpectrum found = spectrum({with_line(0.0, 3, 0.0)});
  for (const OrderLine& line : found.lines) {
    if (line.records == 0) continue;
    EXPECT_NEAR(line.worst.noise_A, 0.05 * std::sqrt(2.0) * std::sqrt(1.5 / 10000.0), 2e-6) << line.kind.name;
    EXPECT_NEAR(line.worst.background_A / line.worst.noise_A, 1.1, 0.7) << line.kind.name;
  }
}

TEST(OrderSpectrum, SeesNoLineInNoise) {
  std::size_t seen = 0, looked_at = 0;
  for (unsigned set = 0; set < 10; ++set) {
    std::vector<Record> records;
    for (unsigned k = 0; k < 6; ++k) records.push_back(with_line(0.0, 10 * set + k + 1, 0.0));
    for (const OrderLine& line : spectrum(records).lines) seen += line.seen, looked_at += line.records;
  }
  fmt::print("{} of {} lines of pure noise seen, in 10 sets with 1 % each\n", seen, looked_at);
  EXPECT_GE(looked_at, 600u);
  EXPECT_LE(seen, 1u);
}

TEST(OrderSpectrum, WithoutDeclaredNoiseStandsOverWhatLiesBeside) {
  const OrderSpectrum found = spectrum({with_line(-kf, 1)}, kMissing);
  EXPECT_FALSE(found.noise_known);
  for (const OrderLine& line : found.lines) {
    const bool there = line.kind.name == std::string("-f");
    EXPECT_EQ(line.seen, there ? 1u : 0u) << line.kind.name;
  }
}

TEST(OrderSpectrum, FollowsALineThatMovesWithTheSpeed) {
  Record record = test::steady_record(KnownMotor(), "r", {.slip = 0.3, .samples = 10000, .sigma_i = 0.01});
  double turned = 0.0;
  for (std::size_t k = 0; k < record.series.size(); ++k) {
    record.series.speed_rad_s[k] *= 1.0 + 0.02 * static_cast<double>(k) / 10000.0;
    record.series.i[k] += std::polar(0.05, 2.0 * kPi * kf * 2e-4 * static_cast<double>(k) + turned);
    turned += 2e-4 * record.series.speed_rad_s[k];
  }
  for (const OrderLine& line : spectrum({record}, 0.01).lines) {
    if (line.kind.name == std::string("f+f_r")) {
      EXPECT_NEAR(line.amplitude_A, 0.05, 0.005);
    }
  }
}

TEST(OrderSpectrum, DoesNotTellApartWhatAShortRecordCannot) {
  Record record = with_line((1 - 2 * kSlip) * kf, 1);
  TimeSeries& s = record.series;
  for (auto* x : {&s.v, &s.i}) x->resize(1500);  // 0.3 s: 3 / T is 10 Hz, 2 s f is 4 Hz
  s.speed_rad_s.resize(1500);
  for (const OrderLine& line : spectrum({record}).lines) {
    if (line.kind.order == std::string("2sf")) {
      EXPECT_EQ(line.records, 0u);
    }
    if (line.kind.order == std::string("2f")) {
      EXPECT_EQ(line.records, 1u);
    }
  }
}

TEST(OrderSpectrum, OfATableIsNone) {
  Record table;
  table.id = "table";
  table.kind = RecordKind::kPoints;
  table.points.push_back(test::steady_point(KnownMotor(), 50.0, 0.02, 200.0));
  EXPECT_TRUE(spectrum({table}).lines.empty());
}

TEST(OrderSpectrum, ForTheEyeHoldsTheStrongestOfEachStep) {
  DataSet data = test::data_set({with_line(-kf, 1, 0.5)});
  const auto result = compare(KnownMotor().model(), data);
  const RecordLines& lines = result.records[0].lines;
  ASSERT_LE(lines.f_Hz.size(), 401u);
  const auto top = std::max_element(lines.amplitude_A.begin(), lines.amplitude_A.end());
  EXPECT_NEAR(*top, 0.5, 0.02);
  EXPECT_NEAR(lines.f_Hz[static_cast<std::size_t>(top - lines.amplitude_A.begin())], -kf, 1.0);
}

}  // namespace
}  // namespace imrig::est
