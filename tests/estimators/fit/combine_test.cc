#include "estimators/fit/combine.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>

#include "estimators/fit/student_t.h"

namespace imrig::est {
namespace {

TEST(StudentTTest, QuantilesAreThoseOfTheTables) {
  EXPECT_NEAR(student_t_975(1), 12.706, 1e-3);
  EXPECT_NEAR(student_t_975(10), 2.228, 1e-3);
  EXPECT_NEAR(student_t_975(60), 2.0003, 2e-4);
  EXPECT_NEAR(student_t_975(1e6), 1.95996, 1e-4);
  EXPECT_NEAR(student_t_975(31), 2.0395, 2e-4);
}

TEST(CombineTest, OneRecordKeepsItsOwnSigma) {
  const Combined c = combine({{5.0, 0.1}});
  EXPECT_EQ(c.value, 5.0);
  EXPECT_DOUBLE_EQ(c.sigma, 0.1);
  EXPECT_NEAR(half_width_95(c, 0.0), 0.196, 1e-3);
}

TEST(CombineTest, RecordsThatAgreeAreWeightedByTheirPrecision) {
  const Combined c = combine({{1.0, 0.1}, {1.05, 0.2}});
  EXPECT_NEAR(c.value, (1.0 * 100 + 1.05 * 25) / 125, 1e-12);
  EXPECT_NEAR(c.sigma, 1.0 / std::sqrt(125.0), 1e-12);  // never below what the records say themselves
}

TEST(CombineTest, ScatterBeyondTheSigmasMakesTheInterval) {
  const Combined c = combine({{1.0, 1e-4}, {1.1, 1e-4}, {0.9, 1e-4}});
  EXPECT_NEAR(c.value, 1.0, 1e-6);
  EXPECT_NEAR(c.sigma, 0.1 / std::sqrt(3.0), 1e-4);
  EXPECT_NEAR(half_width_95(c, 0.0), 4.3027 * 0.1 / std::sqrt(3.0), 1e-3);
}

TEST(CombineTest, CommonErrorsDoNotAverageAway) {
  const Combined c = combine(std::vector<Contribution>(100, {1.0, 0.01}));
  EXPECT_NEAR(half_width_95(c, 0.05), 1.96 * std::hypot(0.001, 0.05), 1e-4);
}

TEST(CombineTest, AnOutlierIsSetAsideWithItsReason) {
  const Combined c = combine({{1.00, 0.01}, {1.01, 0.01}, {0.99, 0.01}, {1.005, 0.01}, {2.0, 0.01}});
  EXPECT_EQ(c.used, 4U);
  EXPECT_THAT(c.outlier[4], testing::HasSubstr("median"));
  EXPECT_EQ(c.outlier[0], "");
  EXPECT_NEAR(c.value, 1.0, 0.01);
}

TEST(CombineTest, IntervalsCoverWithAndWithoutScatterBetweenRecords) {
  for (const double between : {0.0, 0.02}) {
    std::mt19937_64 random(5);
    std::normal_distribution<double> normal;
    int covered = 0;
    const int rounds = 1000;
    for (int round = 0; round < rounds; ++round) {
      std::vector<Contribution> all;
      for (int k = 0; k < 8; ++k) {
        const double sigma = 0.005 * (1 + k % 3);
        all.push_back({1.0 + between * normal(random) + sigma * normal(random), sigma});
      }
      const Combined c = combine(all);
      covered += std::abs(c.value - 1.0) < half_width_95(c, 0.0);
    }
    std::printf("between %.2f: covered %.1f %%\n", between, 100.0 * covered / rounds);
    EXPECT_GT(covered, 0.93 * rounds);
    EXPECT_LT(covered, 0.99 * rounds);
  }
}

}  // namespace
}  // namespace imrig::est
