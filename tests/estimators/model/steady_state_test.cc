#include "estimators/model/steady_state.h"

#include <ceres/jet.h>
#include <gtest/gtest.h>

#include <complex>

#include "estimators/model/output.h"
#include "rig/base/error.h"

namespace imrig::est {
namespace {

using Complex = std::complex<double>;

const MachineParameters<double> kMotor{0.39, 0.22, 0.006, 0.068};
constexpr double kW60 = 2.0 * kPi * 60.0;

TEST(SteadyStateTest, EqualsEquationNineOfThePaper) {
  for (const double f : {10.0, 30.0, 60.0, 90.0}) {
    for (const double s : {-0.05, 0.001, 0.02, 0.3, 1.0, 1.9}) {
      const double w = 2.0 * kPi * f, X_l = w * kMotor.L_l, X_m = w * kMotor.L_m;
      const Complex top(kMotor.R_r / s, X_m);
      const Complex bottom(-X_l * X_m + kMotor.R_s * kMotor.R_r / s,
                           kMotor.R_r / s * (X_l + X_m) + kMotor.R_s * X_m);
      const Complex i = 100.0 * top / bottom;
      const auto state = steady_state(kMotor, 2, 100.0, w, (1.0 - s) * w);
      EXPECT_NEAR(std::abs(plain(state.i_s) - i) / std::abs(i), 0.0, 1e-12) << f << " Hz, slip " << s;
    }
  }
}

TEST(SteadyStateTest, PowerIsCopperLossPlusAirGapPower) {
  const double s = 0.03;
  const auto state = steady_state(kMotor, 2, 179.6, kW60, (1.0 - s) * kW60);
  const double copper = 1.5 * kMotor.R_s * state.current_A * state.current_A;
  EXPECT_NEAR(state.p_in_W, copper + state.torque_Nm * kW60 / 2.0, 1e-9 * state.p_in_W);
  EXPECT_NEAR(state.p_mech_W, (1.0 - s) * state.torque_Nm * kW60 / 2.0, 1e-9 * state.p_in_W);
  EXPECT_NEAR(std::hypot(state.p_in_W, state.q_var), 1.5 * 179.6 * state.current_A, 1e-9 * state.p_in_W);
}

TEST(SteadyStateTest, AtSynchronismOnlyMagnetizingCurrentFlows) {
  const auto state = steady_state(kMotor, 2, 100.0, kW60, kW60);
  EXPECT_NEAR(state.current_A, 100.0 / std::abs(Complex(0.39, kW60 * 0.074)), 1e-10);
  EXPECT_NEAR(state.torque_Nm, 0.0, 1e-12);
}

TEST(SteadyStateTest, AtZeroFrequencyItIsOhmsLaw) {
  EXPECT_NEAR(steady_state(kMotor, 2, 10.0, 0.0, 0.0).current_A, 10.0 / 0.39, 1e-12);
}

TEST(SteadyStateTest, PullOutIsTheHighestPointOfTheTorqueCurve) {
  for (const double f : {5.0, 30.0, 60.0}) {
    const double w = 2.0 * kPi * f;
    const PullOut peak = pull_out(kMotor, 2, 3.0 * f, w);
    const auto torque = [&](double s) {
      return steady_state(kMotor, 2, 3.0 * f, w, (1.0 - s) * w).torque_Nm;
    };
    EXPECT_NEAR(torque(peak.slip), peak.torque_Nm, 1e-9 * peak.torque_Nm);
    EXPECT_LT(torque(0.99 * peak.slip), peak.torque_Nm);
    EXPECT_LT(torque(1.01 * peak.slip), peak.torque_Nm);
  }
}

TEST(SteadyStateTest, OperatingPointCarriesTheTorqueAskedFor) {
  const PullOut peak = pull_out(kMotor, 2, 179.6, kW60);
  for (const double torque : {-0.5 * peak.torque_Nm, -1.0, 0.0, 1.0, 20.0, 0.999 * peak.torque_Nm}) {
    const auto point = operating_point(kMotor, 2, 179.6, 60.0, torque);
    ASSERT_TRUE(point) << torque;
    EXPECT_NEAR(point->state.torque_Nm, torque, 1e-8 * peak.torque_Nm);
    EXPECT_LE(point->slip, peak.slip);
    EXPECT_NEAR(point->speed_rad_s, (1.0 - point->slip) * kW60 / 2.0, 1e-9);
  }
}

TEST(SteadyStateTest, MoreThanPullOutIsNoOperatingPoint) {
  const PullOut peak = pull_out(kMotor, 2, 100.0, kW60);
  EXPECT_FALSE(operating_point(kMotor, 2, 100.0, 60.0, 1.001 * peak.torque_Nm));
  EXPECT_FALSE(operating_point(kMotor, 2, 100.0, 60.0, -100.0 * peak.torque_Nm));
}

TEST(SteadyStateTest, JetDerivativesAgreeWithCentralDifferences) {
  using Jet = ceres::Jet<double, 4>;
  const MachineParameters<Jet> p{Jet(0.39, 0), Jet(0.22, 1), Jet(0.006, 2), Jet(0.068, 3)};
  const auto jets = steady_state(p, 2, 100.0, kW60, 0.97 * kW60);
  const double step = 1e-6;
  auto up = kMotor, down = kMotor;
  up.R_r += step;
  down.R_r -= step;
  const auto a = steady_state(up, 2, 100.0, kW60, 0.97 * kW60),
             b = steady_state(down, 2, 100.0, kW60, 0.97 * kW60);
  EXPECT_NEAR(jets.torque_Nm.v[1], (a.torque_Nm - b.torque_Nm) / (2.0 * step),
              1e-5 * std::abs(jets.torque_Nm.v[1]));
  EXPECT_NEAR(jets.current_A.v[1], (a.current_A - b.current_A) / (2.0 * step),
              1e-5 * std::abs(jets.current_A.v[1]));
  EXPECT_NEAR(jets.p_in_W.v[1], (a.p_in_W - b.p_in_W) / (2.0 * step), 1e-5 * std::abs(jets.p_in_W.v[1]));
}

TEST(PredictPointTest, LeavesTheMeasuredConditionsAndFillsTheRest) {
  SteadyPoint point;
  point.v_peak_V = 179.6;
  point.f_Hz = 60.0;
  point.speed_rad_s = 0.97 * kW60 / 2.0;
  const SteadyPoint out = predict_point(kMotor, 2, point);
  EXPECT_EQ(out.v_peak_V, 179.6);
  EXPECT_GT(out.torque_Nm, 0.0);
  EXPECT_NEAR(out.power_factor, out.p_in_W / (1.5 * 179.6 * out.i_peak_A), 1e-12);
}

TEST(PredictPointTest, WithoutSpeedItSaysSo) {
  SteadyPoint point;
  point.v_peak_V = 179.6;
  point.f_Hz = 60.0;
  EXPECT_THROW(predict_point(kMotor, 2, point), Error);
}

}  // namespace
}  // namespace imrig::est
