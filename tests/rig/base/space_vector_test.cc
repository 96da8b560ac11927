#include "rig/base/space_vector.h"

#include <gtest/gtest.h>

namespace imrig {
namespace {

TEST(SpaceVector, BalancedSystemHasItsPeakAsAmplitudeAndTurnsForward) {
  const double t = 0.3;
  const SpaceVector x = space_vector(5 * std::cos(t), 5 * std::cos(t - 2 * kPi / 3), 5 * std::cos(t + 2 * kPi / 3));
  EXPECT_NEAR(std::abs(x), 5.0, 1e-12);
  EXPECT_NEAR(std::arg(x), t, 1e-12);
}

TEST(SpaceVector, PhasesAreTheInverseWhereTheSumIsZero) {
  const auto p = phases(space_vector(3, -1, -2));
  EXPECT_NEAR(p[0], 3, 1e-12);
  EXPECT_NEAR(p[1], -1, 1e-12);
  EXPECT_NEAR(p[2], -2, 1e-12);
}

TEST(SpaceVector, PowerIsTheSumOfThePhasePowers) {
  EXPECT_NEAR(power_W(space_vector(10, -4, -6), space_vector(2, 1, -3)), 10 * 2 + -4 * 1 + -6 * -3, 1e-12);
}

}  // namespace
}  // namespace imrig
