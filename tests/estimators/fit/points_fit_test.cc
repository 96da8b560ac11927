// The phasor fit of operating points, on points from T-circuit formulas and on a measured table.
#include "estimators/fit/points_fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <cstdio>
#include <random>

#include "estimators/fit/identify.h"
#include "estimators/model/convert.h"
#include "rig/base/error.h"
#include "rig/data/folder.h"
#include "tests/estimators/fit/synthetic.h"

namespace imrig::est {
namespace {

using Complex = std::complex<double>;
using synthetic::Motor;

// A point of the T circuit, straight from its impedances.
SteadyPoint t_circuit_point(const Motor& m, double v_peak_V, double f_Hz, double slip) {
  const double w = 2.0 * kPi * f_Hz;
  const Complex magnetizing(0.0, w * m.L_m);
  const Complex rotor(m.R_r / slip, w * m.L_lr);
  const Complex Z = Complex(m.R_s, w * m.L_ls) + magnetizing * rotor / (magnetizing + rotor);
  const Complex i = v_peak_V / Z;
  SteadyPoint p;
  p.v_peak_V = v_peak_V;
  p.f_Hz = f_Hz;
  p.i_peak_A = std::abs(i);
  p.p_in_W = 1.5 * v_peak_V * i.real();
  p.speed_rad_s = (1.0 - slip) * w / m.pole_pairs;
  return p;
}

std::vector<SteadyPoint> load_curve(const Motor& m) {
  std::vector<SteadyPoint> points;
  for (const double load : {0.03, 0.2, 0.4, 0.6, 0.8, 1.0, 1.2})
    points.push_back(t_circuit_point(m, m.v_peak_V, m.f_Hz, load * m.slip));
  for (const double load : {0.05, 0.5, 1.0})
    points.push_back(t_circuit_point(m, 0.5 * m.v_peak_V, 0.5 * m.f_Hz, 2.0 * load * m.slip));
  return points;
}

MachineParameters<double> truth_of(const Motor& m) {
  return inverse_gamma_of(TCircuit{m.R_s, m.R_r, m.L_ls, m.L_lr, m.L_m});
}

TEST(PointsFitTest, ExactPointsGiveTheCircuitBack) {
  for (const auto& m : synthetic::motors()) {
    PointsOptions options;
    options.pole_pairs = m.pole_pairs;
    const PointsFit fit = fit_points(load_curve(m), options);
    const auto truth = truth_of(m);
    ASSERT_EQ(fit.failure, "") << m.name;
    EXPECT_NEAR(fit.theta.R_s / truth.R_s, 1.0, 1e-4) << m.name;
    EXPECT_NEAR(fit.theta.R_r / truth.R_r, 1.0, 1e-4) << m.name;
    EXPECT_NEAR(fit.theta.L_l / truth.L_l, 1.0, 1e-4) << m.name;
    EXPECT_NEAR(fit.theta.L_m / truth.L_m, 1.0, 1e-4) << m.name;
  }
}

TEST(PointsFitTest, NoisyPointsScatterAsTheIntervalsSay) {
  const Motor& m = synthetic::motors()[2];
  const auto truth = truth_of(m);
  const auto clean = load_curve(m);
  PointsOptions options;
  options.pole_pairs = m.pole_pairs;
  options.noise.current_A = 0.05;
  options.noise.power_W = 20.0;
  options.noise.speed_rad_s = rad_s_of_rpm(0.3);
  const Noise& noise = options.noise;
  const int seeds = 60;
  std::array<double, 4> bias{}, square{}, stated{};
  std::array<int, 4> covered{};
  for (int seed = 0; seed < seeds; ++seed) {
    std::mt19937_64 random(static_cast<std::uint64_t>(100 + seed));
    std::normal_distribution<double> normal;
    auto points = clean;
    for (auto& p : points) {
      p.i_peak_A += noise.current_A * normal(random);
      p.p_in_W += noise.power_W * normal(random);
      p.speed_rad_s += noise.speed_rad_s * normal(random);
    }
    const PointsFit fit = fit_points(points, options);
    ASSERT_EQ(fit.failure, "") << seed;
    const std::array got{fit.theta.R_s / truth.R_s, fit.theta.R_r / truth.R_r, fit.theta.L_l / truth.L_l,
                         fit.theta.L_m / truth.L_m};
    const std::array scale{truth.R_s, truth.R_r, truth.L_l, truth.L_m};
    for (std::size_t k = 0; k < 4; ++k) {
      const double off = got[k] - 1.0;
      bias[k] += off / seeds;
      square[k] += off * off / seeds;
      stated[k] += fit.sigma[k] / scale[k] / seeds;
      covered[k] += std::abs(off) < 2.3 * fit.sigma[k] / scale[k];
    }
  }
  const std::array names{"R_s", "R_r", "L_l", "L_m"};
  for (std::size_t k = 0; k < 4; ++k) {
    std::printf("%s: bias %+.2e, spread %.2e, stated %.2e, inside %d/%d\n", names[k], bias[k],
                std::sqrt(square[k]), stated[k], covered[k], seeds);
    EXPECT_LT(std::abs(bias[k]), 0.5 * std::sqrt(square[k])) << names[k];
    EXPECT_GT(covered[k], 0.88 * seeds) << names[k];
    EXPECT_LT(stated[k], 2.0 * std::sqrt(square[k])) << names[k];
  }
}

TEST(PointsFitTest, WrongNumberOfPolePairsIsNamedWithTheRightOne) {
  PointsOptions options;
  options.pole_pairs = 3;
  try {
    fit_points(load_curve(synthetic::motors()[1]), options);
    FAIL() << "three pole pairs were taken for a four-pole motor";
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), testing::HasSubstr("pole_pairs = 2"));
  }
}

TEST(PointsFitTest, OnePointIsTooFew) {
  PointsOptions options;
  options.pole_pairs = 2;
  const PointsFit fit = fit_points({load_curve(synthetic::motors()[1])[3]}, options);
  EXPECT_THAT(fit.failure, testing::HasSubstr("1 usable point"));
}

TEST(PointsFitTest, MeasuredTableOfThe18kWMotor) {
  const DataSet data = read_folder(std::string(IMRIG_SOURCE_DIR) + "/tests/data/motor_18k5");
  const IdentifyResult result = identify(data);
  PointsOptions options;
  options.pole_pairs = data.pole_pairs;
  options.noise = data.noise;
  const PointsFit fit = fit_points(data.records[0].points, options);
  ASSERT_EQ(fit.failure, "");
  std::printf("   I meas   I model    dI %%    P meas   P model    dP W   shift rpm\n");
  for (std::size_t k = 0; k < fit.used.size(); ++k) {
    const SteadyPoint& p = data.records[0].points[fit.used[k]];
    std::printf("%9.3f %9.3f %+7.2f %9.1f %9.1f %+7.1f %+8.3f\n", p.i_peak_A,
                fit.misfit[k].predicted.i_peak_A, 100.0 * fit.misfit[k].current, p.p_in_W,
                fit.misfit[k].predicted.p_in_W, fit.misfit[k].predicted.p_in_W - p.p_in_W,
                rpm_of_rad_s(fit.misfit[k].speed_shift_rad_s));
  }
  std::printf("chi^2 per degree of freedom %.3g, nrmse %.3g\n", fit.chi2_per_dof, fit.nrmse);
  for (const auto& base : base_parameters()) {
    const Parameter& p = result.model.*base.place;
    std::printf("%s star %.5g [%.5g, %.5g] delta phase %.5g (%s)\n", base.name, p.value, p.ci95_low,
                p.ci95_high, 3.0 * p.value, p.found.c_str());
  }
  for (const auto& note : result.notes) std::printf("note: %s\n", note.c_str());
  for (const auto& note : fit.notes) std::printf("note: %s\n", note.c_str());
}

}  // namespace
}  // namespace imrig::est
