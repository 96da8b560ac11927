// Losses from no-load tests that were computed by hand from a known law.
#include "estimators/fit/losses/core_loss.h"

#include <gtest/gtest.h>

#include <cmath>

namespace imrig::est {
namespace {

struct Law {
  double hysteresis = 60.0, eddy = 45.0, psi = 0.45, f = 60.0;
  double c_0 = 0.25, c_1 = 0.0015, c_2 = 3e-6, drag = 0.0;
  double R_r = 0.22;
  double core_W(double hz, double flux) const {
    return hysteresis * hz / f * std::pow(flux / psi, 2) + eddy * std::pow(hz / f * flux / psi, 2);
  }
};

// At no load the slip carries the torque: w_s = T R_r / (1.5 n_p psi^2).
std::vector<NoLoadPoint> tests_of(const Law& law) {
  std::vector<NoLoadPoint> points;
  for (const double f : {30.0, 45.0, 60.0, 75.0}) {
    for (const double flux : {0.08, 0.12, 0.18, 0.25, 0.33, 0.41, 0.48}) {
      NoLoadPoint p;
      p.record = points.size();
      p.w_e = 2.0 * kPi * f;
      p.psi_r_Wb = flux;
      p.I_A = flux / 0.06 * (1.0 + std::pow(flux / 0.45, 4));
      double T = 0.0;
      for (int round = 0; round < 20; ++round) {  // the slip changes the speed a little
        const double w_M = (p.w_e - p.w_s) / 2.0;
        T = law.c_0 + law.c_1 * w_M + law.c_2 * w_M * w_M + law.drag * p.I_A * p.I_A * std::sqrt(w_M);
        p.w_s = T * law.R_r / (1.5 * 2.0 * flux * flux);
      }
      p.slip_sigma = 1e-4;
      p.P_rotor_W = law.core_W(f, flux) + T * p.w_e / 2.0;
      p.input_W = p.P_rotor_W + 1.5 * 0.39 * p.I_A * p.I_A;
      points.push_back(p);
    }
  }
  return points;
}

TEST(CoreLossTest, SeparatesIronFromFrictionAndStrayDrag) {
  for (const double drag : {0.0, 1e-4}) {
    Law law;
    law.drag = drag;
    const CoreLossResult fit = fit_core_loss(tests_of(law), 2);
    ASSERT_EQ(fit.failure, "");
    EXPECT_EQ(fit.physics.exponent, 2.0);
    for (const double f : {30.0, 60.0, 75.0}) {
      const double w = 2.0 * kPi * f, w_M = w / 2.0;
      EXPECT_NEAR(fit.physics.core_W(w, 0.4) / law.core_W(f, 0.4), 1.0, 0.01) << f << " Hz, drag " << drag;
      EXPECT_NEAR(fit.physics.friction_Nm(w_M) / (law.c_0 + law.c_1 * w_M + law.c_2 * w_M * w_M), 1.0, 0.01);
      EXPECT_NEAR(fit.physics.R_c(w, 0.4), 1.5 * w * w * 0.16 / law.core_W(f, 0.4), 0.01 * fit.physics.R_c(w, 0.4));
    }
    EXPECT_NEAR(fit.physics.R_r.value, law.R_r, 0.01 * law.R_r);
    if (drag > 0.0) {
      EXPECT_NEAR(fit.physics.drag.value, drag, 0.02 * drag);
    }
  }
}

TEST(CoreLossTest, APartOnItsBoundIsNamedAndHasNoInterval) {
  Law law;
  law.c_1 = -2e-4;  // no bearing does that
  const CoreLossResult fit = fit_core_loss(tests_of(law), 2);
  ASSERT_EQ(fit.failure, "");
  EXPECT_EQ(fit.physics.viscous_Nms.value, 0.0);
  EXPECT_TRUE(std::isnan(fit.physics.viscous_Nms.ci95_high));
  bool named = false;
  for (const std::string& note : fit.notes) named = named || note.find("viscous is held at its bound") != std::string::npos;
  EXPECT_TRUE(named);
}

TEST(CoreLossTest, TheNetworkFollowsTheSurfaceAndTheLawThatIsRightPredictsBetter) {
  const CoreLossResult fit = fit_core_loss(tests_of(Law{}), 2);
  ASSERT_EQ(fit.failure, "");
  EXPECT_LT(fit.fitted_network_W, 2.0);
  EXPECT_LT(fit.held_out.network_W, 8.0);
  EXPECT_GT(fit.held_out.network_W, fit.fitted_network_W) << "points not seen are harder";
  EXPECT_TRUE(fit.held_out.physics_wins());
}

TEST(CoreLossTest, SaysWhatIsMissing) {
  auto points = tests_of(Law{});
  points.resize(7);  // one frequency
  EXPECT_NE(fit_core_loss(points, 2).failure.find("12"), std::string::npos);
  for (int copy = 0; copy < 7; ++copy) points.push_back(points[static_cast<std::size_t>(copy)]);
  EXPECT_NE(fit_core_loss(points, 2).failure.find("one frequency"), std::string::npos);
}

TEST(TanhNetworkTest, LearnsASaddleToAFractionOfAPercentAndAlwaysTheSame) {
  Eigen::MatrixXd x(100, 2);
  Eigen::VectorXd y(100);
  for (Eigen::Index k = 0; k < 100; ++k) {
    x.row(k) << static_cast<double>(k % 10), 100.0 * static_cast<double>(k / 10);
    y[k] = 5.0 + x(k, 0) * x(k, 0) - x(k, 1) / 20.0 + x(k, 0) * x(k, 1) / 100.0;
  }
  const TanhNetwork a = train(x, y), b = train(x, y);
  double worst = 0.0;
  for (Eigen::Index k = 0; k < 100; ++k) {
    worst = std::max(worst, std::abs(a.at(x(k, 0), x(k, 1)) - y[k]));
    EXPECT_EQ(a.at(x(k, 0), x(k, 1)), b.at(x(k, 0), x(k, 1)));
  }
  EXPECT_LT(worst, 0.02 * (y.maxCoeff() - y.minCoeff()));
}

}  // namespace
}  // namespace imrig::est
