// Family-wise p-values of the largest score, against counting.

#include "estimators/diagnose/missing/family_wise.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace imrig::est {
namespace {

constexpr Eigen::Index kBlocks = 120;

// Gradients of 12 candidates of one or two amplitudes, neighbours alike; heavy tails, sizes that differ by block.
std::vector<BlockScores> noise(std::mt19937_64& bits) {
  std::student_t_distribution<double> heavy(4.0);
  std::vector<BlockScores> out;
  Eigen::MatrixXd common(2, kBlocks);
  for (double& x : common.reshaped()) x = heavy(bits);
  for (Eigen::Index c = 0; c < 12; ++c) {
    BlockScores u(1 + c % 2, kBlocks);
    for (Eigen::Index b = 0; b < kBlocks; ++b) {
      for (Eigen::Index a = 0; a < u.rows(); ++a)
        u(a, b) = (1.0 + static_cast<double>(b % 5)) * (heavy(bits) + 0.7 * common(a, b));
    }
    out.push_back(std::move(u));
  }
  return out;
}

TEST(FamilyWise, NoiseReachesOnePerCentInOnePerCentOfDataSets) {
  std::mt19937_64 bits(7);
  int found_5 = 0, found_20 = 0;
  constexpr int kSets = 400;
  for (int n = 0; n < kSets; ++n) {
    const auto p = family_wise_p(noise(bits), 199);
    const double least = *std::min_element(p.begin(), p.end());
    found_5 += least <= 0.05 ? 1 : 0;
    found_20 += least <= 0.20 ? 1 : 0;
  }
  // Four standard deviations of a binomial about 5 and 20 %.
  EXPECT_NEAR(found_5, 0.05 * kSets, 4.0 * std::sqrt(0.05 * 0.95 * kSets));
  EXPECT_NEAR(found_20, 0.20 * kSets, 4.0 * std::sqrt(0.2 * 0.8 * kSets));
}

TEST(FamilyWise, WhatAllBlocksAskForIsFoundAndTheOthersAreNot) {
  std::mt19937_64 bits(3);
  auto candidates = noise(bits);
  candidates[4].row(0).array() += 3.0;
  const auto p = family_wise_p(candidates);
  EXPECT_DOUBLE_EQ(p[4], 1e-3);
  candidates.erase(candidates.begin() + 4);
  for (const double others : family_wise_p(candidates)) EXPECT_GT(others, 0.01);
}

TEST(FamilyWise, StatisticOfOneAmplitudeIsTheSquaredSumOverTheSumOfSquares) {
  BlockScores u(1, 3);
  u << 1.0, 2.0, 2.0;
  EXPECT_NEAR(block_statistics({u}).front(), 25.0 / 9.0, 1e-12);
}

TEST(FamilyWise, AnAmplitudeWithoutInfluenceHasNoStatistic) {
  const BlockScores none = BlockScores::Zero(1, 5);
  EXPECT_EQ(block_statistics({none}).front(), 0.0);
  EXPECT_DOUBLE_EQ(family_wise_p({none}).front(), 1.0);
}

}  // namespace
}  // namespace imrig::est
