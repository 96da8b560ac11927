#include "rig/bus/speed_from_counts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace imrig {
namespace {

constexpr double kT = 60e-6;
constexpr int kPerRev = 4096;
constexpr double kUnit = 2.0 * std::numbers::pi / kPerRev / kT;  // rad/s per count a sample

std::vector<std::int64_t> counts_of(std::size_t n, auto&& at) {
  std::vector<std::int64_t> counts;
  for (std::size_t k = 0; k < n; ++k)
    counts.push_back(static_cast<std::int64_t>(std::floor(at(static_cast<double>(k)))));
  return counts;
}

TEST(SpeedFromCounts, StandstillIsExactlyZero) {
  for (const double w : speed_from_counts(std::vector<std::int64_t>(1000, 12345), 0, 1000, kT, kPerRev))
    EXPECT_EQ(w, 0.0);
}

TEST(SpeedFromCounts, WholeCountsPerSampleAreExactEverywhere) {
  const auto speed =
      speed_from_counts(counts_of(1000, [](double k) { return 100.0 - 7.0 * k; }), 0, 1000, kT, kPerRev);
  for (const double w : speed) EXPECT_NEAR(w, -7.0 * kUnit, 1e-9 * kUnit);
}

TEST(SpeedFromCounts, ConstantAccelerationMakesNoErrorNotEvenAtTheEnds) {
  const auto counts = counts_of(1000, [](double k) { return 3.0 * k * k - 200.0 * k; });
  const auto speed = speed_from_counts(counts, 0, 1000, kT, kPerRev);
  for (std::size_t k = 0; k < 1000; ++k)
    EXPECT_NEAR(speed[k], (6.0 * static_cast<double>(k) - 200.0) * kUnit, 1e-7 * kUnit) << k;
}

TEST(SpeedFromCounts, ACubicAngleMakesNoErrorNotEvenAtTheEnds) {
  const auto counts = counts_of(1000, [](double k) { return k * k * k - 40.0 * k * k; });
  const auto speed = speed_from_counts(counts, 0, 1000, kT, kPerRev);
  for (std::size_t n = 0; n < 1000; ++n) {
    const auto k = static_cast<double>(n);
    EXPECT_NEAR(speed[n], (3.0 * k * k - 80.0 * k) * kUnit, 1e-6 * kUnit) << k;
  }
}

TEST(SpeedFromCounts, AShaftSwingOf20HzKeepsItsAmplitude) {
  const double w = 2.0 * std::numbers::pi * 20.0 * kT;  // rad a sample
  const auto counts = counts_of(20000, [&](double k) { return 30.0 * k + 4000.0 * std::sin(w * k); });
  const auto speed = speed_from_counts(counts, 0, 20000, kT, kPerRev);
  double in_phase = 0.0;
  for (std::size_t k = 1000; k < 18500; ++k) {  // 21 whole turns
    in_phase += speed[k] / kUnit * std::cos(w * static_cast<double>(k));
  }
  EXPECT_NEAR(in_phase / 8750.0 / (4000.0 * w), 1.0, 0.003);
}

TEST(SpeedFromCounts, RoundingNoiseIsThatOfTheFormula) {
  // Irrational counts per sample spread the rounding evenly.
  const double rate = 7.0 + std::numbers::inv_pi;
  const auto speed =
      speed_from_counts(counts_of(200000, [&](double k) { return rate * k; }), 0, 200000, kT, kPerRev);
  double squares = 0.0;
  for (std::size_t k = 1000; k < 199000; ++k) squares += std::pow(speed[k] - rate * kUnit, 2);
  const double rms = std::sqrt(squares / 198000.0);
  EXPECT_LT(rms, 1.2 * speed_noise_rad_s(kT, kPerRev));
  EXPECT_LT(speed_noise_rad_s(kT, kPerRev), 0.02);  // 0.2 rpm at 4096 counts
}

TEST(SpeedFromCounts, MarginsMakeTheEndsAsGoodAsTheMiddle) {
  const auto counts = counts_of(1000, [](double k) { return 7.3 * k + 40.0 * std::sin(0.02 * k); });
  const auto whole = speed_from_counts(counts, 0, 1000, kT, kPerRev);
  const auto part = speed_from_counts(counts, 200, 300, kT, kPerRev);
  ASSERT_EQ(part.size(), 300u);
  for (std::size_t k = 0; k < 300; ++k) EXPECT_EQ(part[k], whole[200 + k]);
}

TEST(SpeedFromCounts, ShortRecordsGetAFitOverAllTheyHave) {
  for (const std::size_t n : {2u, 3u, 5u, 50u, 100u, 166u, 167u, 168u}) {
    const auto speed = speed_from_counts(counts_of(n, [](double k) { return 5.0 * k; }), 0, n, kT, kPerRev);
    for (const double w : speed) EXPECT_NEAR(w, 5.0 * kUnit, 1e-9 * kUnit) << n;
  }
  EXPECT_TRUE(std::isnan(speed_from_counts(std::vector<std::int64_t>{1}, 0, 1, kT, kPerRev)[0]));
}

TEST(SpeedFromCounts, CountsAreUnwrappedAtTheirOverflowBothWays) {
  for (const std::int64_t step : {1000, -1000}) {
    std::vector<std::int32_t> wrapped;
    std::int64_t c = step > 0 ? 2147483000 : -2147483000;
    for (int k = 0; k < 10; ++k, c += step)
      wrapped.push_back(static_cast<std::int32_t>(static_cast<std::uint32_t>(c)));
    const auto counts = unwrap_counts(wrapped);
    for (std::size_t k = 1; k < counts.size(); ++k) EXPECT_EQ(counts[k] - counts[k - 1], step);
  }
}

}  // namespace
}  // namespace imrig
