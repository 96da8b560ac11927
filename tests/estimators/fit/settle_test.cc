#include "estimators/fit/global/settle.h"

#include <gtest/gtest.h>

#include "estimators/model/effects/registry.h"

namespace imrig::est {
namespace {

const std::size_t kRounding = kLocalPlace[*effect_number("speed_bias")];
const std::size_t kWarmth = kLocalPlace[*effect_number("rotor_heating")];

// chi2/2 of a step d, up to a constant.
double cost(const Eigen::MatrixXd& D, const Eigen::VectorXd& g, const Eigen::VectorXd& d) {
  return 0.5 * d.dot(D * d) + g.dot(d);
}

// Heat and a speed that is off look nearly alike: the one that may not go on leaves its part to the other.
TEST(BoundedStep, EndsOnTheBoundAndTheOthersMakeUpForIt) {
  Eigen::MatrixXd D(2, 2);
  D << 4.0, 3.8, 3.8, 4.0;
  const Eigen::Vector2d g(-20.0, -18.0);
  LocalVector<double> x{};
  const std::vector<std::size_t> free{kRounding, kWarmth};
  const Eigen::VectorXd step = bounded_step(D, g, free, x);
  const double bound = local_parameter(kRounding).high;
  EXPECT_DOUBLE_EQ(step[0], bound);
  EXPECT_LE(step[1], local_parameter(kWarmth).high);
  for (const double other : {-0.3, 0.0, 0.2, 0.5, 0.9}) {
    EXPECT_LE(cost(D, g, step), cost(D, g, Eigen::Vector2d(bound, other)) + 1e-12) << other;
  }
}

TEST(BoundedStep, IsNewtonsWhereNoBoundIsNear) {
  Eigen::MatrixXd D(2, 2);
  D << 400.0, 3.0, 3.0, 4000.0;
  const Eigen::Vector2d g(-20.0, 18.0);
  const Eigen::VectorXd step = bounded_step(D, g, {kRounding, kWarmth}, {});
  EXPECT_LT((D * step + g).norm(), 1e-12);
}

TEST(LocalPriors, AnEntryThatWantsBeyondItsBoundSaysNothing) {
  LocalVector<double> x{};
  x[kRounding] = local_parameter(kRounding).high;
  RecordTerms terms;
  terms.normal = Eigen::Matrix3d::Constant(2.0);
  terms.gradient = Eigen::Vector3d(1.0, -50.0, 1.0);
  add_local_priors({kRounding, kWarmth}, x, 1, terms);
  EXPECT_NEAR(terms.chi2, 3.0, 1e-6);  // half a step is the square root of three sigmas
  EXPECT_EQ(terms.gradient[1], 0.0);
  EXPECT_EQ(terms.normal(0, 1), 0.0);
  EXPECT_EQ(terms.normal(1, 0), 0.0);
  EXPECT_EQ(terms.normal(0, 2), 2.0);
  terms.gradient[1] = 50.0;  // wants back
  terms.normal = Eigen::Matrix3d::Constant(2.0);
  add_local_priors({kRounding, kWarmth}, x, 1, terms);
  EXPECT_EQ(terms.normal(0, 1), 2.0);
}

}  // namespace
}  // namespace imrig::est
