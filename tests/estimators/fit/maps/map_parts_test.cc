// The parts that maps are made of, each against what can be said by hand.
#include <gtest/gtest.h>

#include <cmath>

#include "estimators/fit/correlation.h"
#include "estimators/fit/maps/linear_fit.h"
#include "estimators/fit/maps/magnetizing_fit.h"
#include "estimators/fit/maps/mapped_machine.h"
#include "estimators/fit/maps/resistance_line.h"
#include "estimators/fit/maps/sensitivity.h"
#include "estimators/model/model_file.h"
#include "estimators/model/steady_state.h"

namespace imrig::est {
namespace {

constexpr MachineParameters<double> kPaperMotor{0.39, 0.22, 0.006, 0.068};

TEST(CorrelationTest, IsOneOnALineAndTheTextbooksFigureElsewhere) {
  EXPECT_NEAR(correlation({1, 2, 3, 4}, {3, 5, 7, 9}), 1.0, 1e-12);
  EXPECT_NEAR(correlation({1, 2, 3, 4}, {9, 7, 5, 3}), -1.0, 1e-12);
  EXPECT_NEAR(correlation({1, 2, 3}, {1, 3, 2}), 0.5, 1e-12);
  EXPECT_TRUE(std::isnan(correlation({1, 1, 1}, {1, 2, 3})));
  EXPECT_TRUE(std::isnan(correlation({1, 2}, {1, 2})));
}

TEST(LinearFitTest, IntervalsComeFromClusterToCluster) {
  // Two groups of many equal rows that disagree: their number must not narrow the interval of the mean.
  Eigen::MatrixXd A = Eigen::MatrixXd::Ones(200, 1);
  Eigen::VectorXd y(200), sigma = Eigen::VectorXd::Constant(200, 0.01);
  std::vector<std::size_t> cluster;
  for (Eigen::Index k = 0; k < 200; ++k) {
    y[k] = k < 100 ? 1.0 : 2.0;
    cluster.push_back(k < 100 ? 0 : 1);
  }
  const LinearFit fit = linear_fit(A, y, sigma, cluster);
  EXPECT_NEAR(fit.c[0], 1.5, 1e-12);
  EXPECT_NEAR(std::sqrt(fit.covariance(0, 0)), 0.5, 0.01);  // of two values one apart
}

TEST(ResistanceLineTest, FindsR20AndAlphaAndSaysWhenThereIsNoSpread) {
  std::vector<ResistancePoint> points;
  for (const double T : {22.0, 60.0, 90.0, 120.0}) points.push_back({"dc", T, 0.38 * (1.0 + 0.00393 * (T - 20.0)), 1e-4});
  const ResistanceLine line = resistance_line(points, 0.0);
  ASSERT_EQ(line.failure, "");
  EXPECT_NEAR(line.R_20.value, 0.38, 1e-9);
  EXPECT_NEAR(line.alpha.value, 0.00393, 1e-9);
  EXPECT_NEAR(line.at(75.0), 0.38 * (1.0 + 0.00393 * 55.0), 1e-9);
  for (auto& point : points) point.stator_C = 25.0;
  EXPECT_NE(resistance_line(points, 0.0).failure.find("0.0 K"), std::string::npos);
}

TEST(MagnetizingMapTest, FindsKneeAndParabolaAndJoinsThem) {
  const double L_0 = 0.066, knee = 2.2, b = -0.0042, c = 1.1e-4;
  std::vector<MagnetizingSample> samples;
  for (std::size_t k = 0; k < 40; ++k) {
    const double I = 0.8 + 0.3 * static_cast<double>(k), above = std::max(0.0, I - knee);
    samples.push_back({I, L_0 + b * above + c * above * above, 1e-3, k});
  }
  const MagnetizingMap map = fit_magnetizing(samples, 0.0);
  ASSERT_TRUE(map.known());
  EXPECT_NEAR(map.knee_A, knee, 0.01);
  EXPECT_NEAR(map.L_0.value, L_0, 1e-6);
  EXPECT_NEAR(map.k_1.value, c, 1e-7);
  EXPECT_NEAR(map.at(map.knee_A - 1e-9), map.at(map.knee_A + 1e-9), 1e-9);
  EXPECT_EQ(map.at(100.0), map.at(map.highest_A));
}

// Figure 4: R_r and L_l are blind at no load, L_m fades with slip, and near 2 % at 60 Hz R_r has taken over.
TEST(SensitivityTest, ReproducesThePapersFigure4) {
  const auto curve = sensitivity_curve(kPaperMotor, 60.0);
  EXPECT_EQ(curve.value.front().R_r, 0.0);
  EXPECT_LT(curve.value.front().L_l, 0.02 * curve.value.front().L_m);
  for (std::size_t k = 1; k < curve.value.size(); ++k) {
    EXPECT_LT(curve.value[k].L_m, curve.value[k - 1].L_m) << "slip " << curve.slip[k];
    EXPECT_GT(curve.value[k].L_l, curve.value[k - 1].L_l) << "slip " << curve.slip[k];
  }
  const Sensitivity low = sensitivity_at(kPaperMotor, 2.0 * kPi * 60.0, 0.004);
  const Sensitivity high = sensitivity_at(kPaperMotor, 2.0 * kPi * 60.0, 0.03);
  EXPECT_GT(low.L_m, low.R_r);
  EXPECT_GT(high.R_r, 5.0 * high.L_m);
  EXPECT_GT(high.L_l, high.L_m);
}

ParameterMaps saturated_maps() {
  ParameterMaps maps;
  maps.R_s.failure = "not measured";
  maps.core.failure = "not measured";
  std::vector<MagnetizingSample> samples;
  for (std::size_t k = 0; k < 40; ++k) {
    const double I = 0.5 + 0.3 * static_cast<double>(k), above = std::max(0.0, I - 2.0);
    samples.push_back({I, 0.068 - 0.004 * above + 1e-4 * above * above, 1e-3, k});
  }
  maps.L_m = fit_magnetizing(samples, 0.0);
  return maps;
}

TEST(MappedMachineTest, WithoutMapsIsTheBaseMachine) {
  ParameterMaps none;
  none.R_s.failure = none.core.failure = "none";
  const MappedMachine machine(none, kPaperMotor, kMissing, 377.0);
  const auto own = mapped_steady(machine, 180.0, 377.0, 366.0);
  const auto base = steady_state(kPaperMotor, 2, 180.0, 377.0, 366.0);
  ASSERT_TRUE(own.settled);
  EXPECT_NEAR(own.p_in_W, base.p_in_W, 1e-6 * base.p_in_W);
  EXPECT_NEAR(std::abs(own.i_s), base.current_A, 1e-6 * base.current_A);
  const FluxState<double> x{{0.4, 0.1}, {0.38, 0.02}};
  const auto a = machine.derivative({x.psi_s, x.psi_r, {}}, {180.0, 5.0}, 366.0, 377.0);
  const auto b = BaseMachine<double>(kPaperMotor).derivative(x, {180.0, 5.0}, 366.0, 377.0);
  EXPECT_NEAR(a.psi_r.re, b.psi_r.re, 1e-9);
  EXPECT_NEAR(a.psi_r.im, b.psi_r.im, 1e-9);
  EXPECT_NEAR(a.psi_s.re, b.psi_s.re, 1e-9);
}

// Steady state twice: as a fixed point of phasors, and where the time derivative in the supply's frame vanishes.
TEST(MappedMachineTest, PhasorsAndTimeDerivativeAgreeInSaturation) {
  const ParameterMaps maps = saturated_maps();
  const double w_e = 377.0, w_r = 368.0, v = 180.0;
  const MappedMachine machine(maps, kPaperMotor, kMissing, w_e);
  const auto steady = mapped_steady(machine, v, w_e, w_r);
  ASSERT_TRUE(steady.settled);
  EXPECT_GT(std::abs(steady.i_s), 1.02 * steady_state(kPaperMotor, 2, v, w_e, w_r).current_A);
  const std::complex<double> psi_s = (v - kPaperMotor.R_s * steady.i_s) / std::complex<double>(0.0, w_e);
  const std::complex<double> psi_r = psi_s - kPaperMotor.L_l * steady.i_s;
  const auto d = machine.derivative({Cx<double>(psi_s), Cx<double>(psi_r), {}}, v, w_r, w_e);
  EXPECT_LT(std::hypot(std::hypot(d.psi_s.re, d.psi_s.im), std::hypot(d.psi_r.re, d.psi_r.im)), 1e-4 * v);
}

TEST(ModelFileTest, MapsComeBackToTheSameBitsAndUnknownOnesAreRefused) {
  Model model;
  model.pole_pairs = 2;
  model.R_s = {0.39, 0.38, 0.4, "ohm", "dc"};
  model.maps = {{"R_r", {{"k_6", {2.28e-4, 2.2e-4, 2.4e-4, "ohm s", "locked"}}, {"R_1", {0.21, 0.2, 0.22, "ohm", ""}}}}};
  const Model back = parse_model(to_toml(model), "test");
  ASSERT_EQ(back.maps.size(), 1u);
  EXPECT_EQ(back.maps[0].parameters.at("k_6").value, 2.28e-4);
  EXPECT_EQ(back.maps[0].parameters.at("k_6").ci95_high, 2.4e-4);
  EXPECT_EQ(to_toml(back), to_toml(model));
  EXPECT_ANY_THROW(parse_model(to_toml(model) + "\n[maps.L_m.k_9]\nvalue = 1.0\nunit = \"H\"\n", "test"));
  EXPECT_ANY_THROW(parse_model(to_toml(model) + "\n[maps.nonsense.a]\nvalue = 1.0\nunit = \"H\"\n", "test"));
}

}  // namespace
}  // namespace imrig::est
