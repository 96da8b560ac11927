// All records at once, against records made by another route (synthetic.h: T circuit, matrix exponential).

#include "estimators/fit/global/global_fit.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "estimators/model/convert.h"
#include "estimators/model/effects/registry.h"
#include "estimators/model/steady_state.h"
#include "tests/estimators/fit/synthetic.h"

namespace imrig::est {
namespace {

MachineParameters<double> truth(const synthetic::Motor& m) {
  const double L_s = m.L_ls + m.L_m, L_r = m.L_lr + m.L_m, k = m.L_m / L_r;
  return {m.R_s, m.R_r * k * k, L_s - m.L_m * k, m.L_m * k};
}

DataSet grid(const synthetic::Motor& motor, std::uint64_t seed, const Noise& noise) {
  DataSet data;
  data.name = motor.name;
  data.pole_pairs = motor.pole_pairs;
  data.noise = noise;
  for (const double f : {0.5, 1.0}) {
    for (const double slip : {0.3, 1.0}) {
      Record record;
      record.id = fmt::format("f{}_s{}", f, slip);
      record.kind = RecordKind::kStep;
      record.series =
          synthetic::record(motor, synthetic::step_case(motor, 0.9 * f, f, slip * motor.slip, 200e-6, 1500));
      synthetic::add_noise(record.series, noise.current_A, noise.voltage_V, noise.speed_rad_s, seed++);
      data.records.push_back(std::move(record));
    }
  }
  return data;
}

SharedVector<double> at(const MachineParameters<double>& p) {
  SharedVector<double> out{p.R_s, p.R_r, p.L_l, p.L_m};
  for (std::size_t e = kBase; e < kShared; ++e) out[e] = shared_parameter(e).neutral;
  return out;
}

const Freedom kBaseOnly{{0, 1, 2, 3}, {0, 1, 2, 3}};

GlobalFit fitted(const DataSet& data, const MachineParameters<double>& from) {
  GlobalProblem problem(data, from, 2);
  GlobalPoint start = problem.start(at(from));
  problem.settle(start, kBaseOnly.local, problem.all());
  GlobalFit fit = fit_global(problem, start, kBaseOnly, problem.fitted());
  problem.refresh(fit.at.shared);
  GlobalFitOptions options;
  options.unbiased = true;
  return fit_global(problem, fit.at, kBaseOnly, problem.fitted(), options);
}

TEST(GlobalFit, FindsTheCircuitOfEveryMotorFromAStartThatIsAThirdOff) {
  for (const auto& motor : synthetic::motors()) {
    const auto p = truth(motor);
    const double current = motor.v_peak_V / (40.0 * (p.R_s + p.R_r));
    const auto data = grid(motor, 1, {1e-6 * current, 1e-6 * motor.v_peak_V, 1e-9, kMissing, kMissing});
    const GlobalFit fit = fitted(data, {0.7 * p.R_s, 1.3 * p.R_r, 1.3 * p.L_l, 0.7 * p.L_m});
    EXPECT_TRUE(fit.converged) << motor.name;
    // R_s i is a few per cent of v, so what thinning leaves of v, some 1e-5, shows in it first.
    EXPECT_NEAR(fit.at.shared[0] / p.R_s, 1.0, 1e-3) << motor.name;
    EXPECT_NEAR(fit.at.shared[1] / p.R_r, 1.0, 2e-4) << motor.name;
    EXPECT_NEAR(fit.at.shared[2] / p.L_l, 1.0, 2e-4) << motor.name;
    EXPECT_NEAR(fit.at.shared[3] / p.L_m, 1.0, 2e-4) << motor.name;
  }
}

TEST(GlobalFit, ErrorsAreWhiteAndIntervalsHoldWhateverChannelTheNoiseIsIn) {
  const auto& motor = synthetic::motors()[1];
  const auto p = truth(motor);
  for (const Noise& noise :
       {Noise{0.05, 1e-6, 1e-9, kMissing, kMissing}, Noise{0.03, 0.3, 1e-9, kMissing, kMissing},
        Noise{0.02, 0.3, 0.2, kMissing, kMissing}}) {
    double chi2 = 0.0;
    std::array<double, 4> z2{};
    constexpr int kSeeds = 20;
    for (int seed = 0; seed < kSeeds; ++seed) {
      const GlobalFit fit = fitted(grid(motor, 1000 + 10 * static_cast<std::uint64_t>(seed), noise), p);
      chi2 += fit.chi2 / fit.dof / kSeeds;
      const std::array<double, 4> true_values{p.R_s, p.R_r, p.L_l, p.L_m};
      for (std::size_t k = 0; k < 4; ++k)
        z2[k] += std::pow((fit.at.shared[k] - true_values[k]), 2) /
                 fit.noise_covariance(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(k)) / kSeeds;
    }
    // Thinning leaves some 4500 values a fit.
    EXPECT_NEAR(chi2, 1.0, 0.05) << noise.current_A << " " << noise.voltage_V;
    // Mean of 20 squares of standard normals: 1 +- 0.32; 4 of them, 3 kinds of noise.
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_GT(z2[k], 0.3) << k << " at " << noise.voltage_V;
      EXPECT_LT(z2[k], 2.3) << k << " at " << noise.voltage_V;
      std::printf("current %.3g A, voltage %.3g V, speed %.3g rad/s: chi2 %.3f, %s spread over bound %.2f\n",
                  noise.current_A, noise.voltage_V, noise.speed_rad_s, chi2, shared_name(k).c_str(),
                  std::sqrt(z2[k]));
    }
  }
}

TEST(GlobalFit, TheSameDataGiveTheSameBitsWithOneThreadAndTwo) {
  const auto& motor = synthetic::motors()[1];
  const auto data = grid(motor, 3, {0.05, 0.3, 0.05, kMissing, kMissing});
  std::array<GlobalFit, 2> fits;
  for (int threads = 1; threads <= 2; ++threads) {
    GlobalProblem problem(data, truth(motor), threads);
    GlobalPoint start = problem.start(at(truth(motor)));
    problem.settle(start, kBaseOnly.local, problem.all());
    fits[static_cast<std::size_t>(threads - 1)] = fit_global(problem, start, kBaseOnly, problem.fitted());
  }
  EXPECT_EQ(fits[0].at.shared, fits[1].at.shared);
  EXPECT_EQ(fits[0].chi2, fits[1].chi2);
}

TEST(PointsTerms, WithoutEffectsASteadyPointIsThatOfThePhasors) {
  const auto& motor = synthetic::motors()[2];
  const auto p = truth(motor);
  SteadyPoint point;
  point.v_peak_V = motor.v_peak_V;
  point.f_Hz = motor.f_Hz;
  const double w_e = 2.0 * kPi * motor.f_Hz;
  for (const double slip : {0.0, 0.01, 0.03, 1.0}) {
    point.speed_rad_s = (1.0 - slip) * w_e / motor.pole_pairs;
    const auto expected =
        steady_state(p, motor.pole_pairs, point.v_peak_V, w_e, motor.pole_pairs * point.speed_rad_s);
    const auto found = predict_steady(at(p), motor.pole_pairs, point);
    EXPECT_NEAR(found.i_peak_A, expected.current_A, 1e-8 * expected.current_A) << slip;
    EXPECT_NEAR(found.p_in_W, expected.p_in_W, 1e-8 * std::abs(expected.p_in_W) + 1e-7) << slip;
    EXPECT_NEAR(found.torque_Nm, expected.torque_Nm, 1e-8 * std::abs(expected.torque_Nm) + 1e-8) << slip;
  }
}

TEST(PointsTerms, DerivativesAreThoseOfDifferences) {
  const auto& motor = synthetic::motors()[2];
  auto p = at(truth(motor));
  p[kSharedPlace[0]] = 0.4;  // magnetizing saturation
  p[kSharedPlace[0] + 4] = 1.2 * motor.v_peak_V / (2.0 * kPi * motor.f_Hz);
  SteadyPoint point;
  point.v_peak_V = motor.v_peak_V;
  point.f_Hz = motor.f_Hz;
  point.speed_rad_s = (1.0 - motor.slip) * 2.0 * kPi * motor.f_Hz / motor.pole_pairs;
  point.i_peak_A = 1.0;
  const PointNoise noise{1.0, 1.0, 1.0, 0.0};
  const Lanes lanes{{0, 1, 2, 3, kSharedPlace[0], kSharedPlace[0] + 1}, {}};
  const RecordTerms terms = points_terms({point}, motor.pole_pairs, noise, p, lanes);
  for (std::size_t k = 0; k < lanes.shared.size(); ++k) {
    const double h = 1e-5 * p[lanes.shared[k]];
    auto up = p, down = p;
    up[lanes.shared[k]] += h;
    down[lanes.shared[k]] -= h;
    const double slope = (points_terms({point}, motor.pole_pairs, noise, up, {}).chi2 -
                          points_terms({point}, motor.pole_pairs, noise, down, {}).chi2) /
                         (2.0 * h);
    EXPECT_NEAR(2.0 * terms.gradient[static_cast<Eigen::Index>(k)], slope, 1e-5 * std::abs(slope))
        << shared_name(lanes.shared[k]);
  }
}

// A motor without saturation: its share lies at zero and its exponent means nothing.
TEST(GlobalFit, WhatLiesOnABoundOrIsNotDeterminedHasNoIntervalAndIsNamed) {
  const synthetic::Motor& motor = synthetic::motors()[1];
  const DataSet data = grid(motor, 40, {0.05, 1e-6, 1e-9, kMissing, kMissing});
  GlobalProblem problem(data, truth(motor), 2);
  const std::size_t extra = kSharedPlace[0], exponent = extra + 1;
  const Freedom free{{0, 1, 2, 3, extra, exponent}, {0, 1, 2, 3}};
  GlobalPoint start = problem.start(at(truth(motor)));
  start.shared[extra] = shared_parameter(extra).low;
  problem.settle(start, free.local, problem.all());
  std::size_t held = 0;
  for (const double R_s : {0.97, 1.0, 1.03}) {  // whichever sign the noise gives the share
    GlobalPoint from = start;
    from.shared[0] *= R_s;
    const GlobalFit fit = fit_global(problem, from, free, problem.fitted());
    ASSERT_TRUE(std::isfinite(fit.chi2));
    for (std::size_t e = 0; e < 4; ++e) EXPECT_GT(fit.sigma(e), 0.0) << shared_name(e);
    if (fit.at.shared[extra] > shared_parameter(extra).low) continue;
    ++held;
    EXPECT_EQ(fit.caveat(extra), "on a bound of what it can be");
    EXPECT_EQ(fit.caveat(exponent), "not determined by these data");
    EXPECT_TRUE(std::isnan(fit.sigma(extra)));
    EXPECT_TRUE(std::isnan(fit.sigma(exponent)));
    EXPECT_EQ(fit.caveat(0), "");
  }
  EXPECT_GT(held, 0u);
}

}  // namespace
}  // namespace imrig::est
