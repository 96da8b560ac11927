// The transient fit against records made by another route (synthetic.h): accuracy, spread against the
// Cramer-Rao bound, coverage.
#include "estimators/fit/transient_fit.h"

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>

#include "estimators/fit/transient_search.h"
#include "tests/estimators/fit/spread.h"

namespace imrig::est {
namespace {

using synthetic::Motor;
using synthetic::options_near;
using synthetic::Spread;
using synthetic::three;
using synthetic::truth_of;

// Statistics need many fits; the sanitizers' builds, fifty times slower, check the code on the other tests.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSlowBuild = true;
#else
constexpr bool kSlowBuild = false;
#endif

constexpr auto& kNames = synthetic::kSpreadNames;

double milliseconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
}

TEST(TransientFitTest, CleanRecordsGiveTheMotorBackFromWrongStarts) {
  for (const auto& m : synthetic::motors()) {
    const auto truth = truth_of(m);
    for (const double h : {20e-6, 60e-6, 200e-6, 1e-3}) {
      if (kSlowBuild && h < 1e-3) continue;
      const std::size_t n = h < 1e-4 ? 5000 : h < 5e-4 ? 3000 : 1000;
      auto c = synthetic::step_case(m, 0.8, 0.9, m.slip, h, n);
      c.filter_s = std::max(200e-6, 2.0 * h);
      const FrameRecord frame = to_frame(synthetic::record(m, c), m.pole_pairs);
      for (const auto& start : {std::array{1.8, 0.6, 0.7}, std::array{0.5, 1.9, 1.6}}) {
        const auto begin = std::chrono::steady_clock::now();
        const TransientFit fit = fit_transient(frame, options_near(truth, start[0], start[1], start[2]));
        const double ms = milliseconds_since(begin);
        ASSERT_EQ(fit.failure, "") << m.name << " " << h;
        double worst = 0.0;
        for (std::size_t k = 0; k < 3; ++k)
          worst = std::max(worst, std::abs(three(fit.theta)[k] / three(truth)[k] - 1.0));
        std::printf("%-22s %5.0f us, %zu samples: worst error %.1e, nrmse %.1e, %d evaluations, %.1f ms\n",
                    m.name, h * 1e6, n, worst, fit.nrmse, fit.evaluations, ms);
        EXPECT_LT(worst, h > 5e-4 ? 3e-3 : 5e-4) << m.name << " " << h;
      }
    }
  }
}

void print_spread(const Motor& m, const Spread& s) {
  const auto truth = three(truth_of(m));
  for (std::size_t k = 0; k < 3; ++k) {
    std::printf("  %s bias %+.3f %%, spread %.3f %%, stated %.3f %%, inside 95 %%: %d/%d\n", kNames[k],
                100.0 * s.bias[k] / truth[k], 100.0 * s.deviation[k] / truth[k],
                100.0 * s.stated[k] / truth[k], s.covered[k], s.seeds);
  }
}

TEST(TransientFitTest, SpreadReachesTheCramerRaoBound) {
  if (kSlowBuild) GTEST_SKIP() << "statistics are checked in the release build";
  const int seeds = 120;
  for (const std::size_t which : {0UL, 1UL, 3UL}) {
    const Motor& m = synthetic::motors()[which];
    const auto c = synthetic::released_case(m, 3000);
    const double noise = synthetic::usual_noise_A(m, c);
    const auto bound = synthetic::cramer_rao(m, c, noise);
    const Spread s = synthetic::spread_of(m, synthetic::record(m, c), noise, 0.0, 0.0, seeds);
    EXPECT_EQ(s.failed, 0) << m.name;
    std::printf("%s, %.3f A\n", m.name, noise);
    print_spread(m, s);
    for (std::size_t k = 0; k < 3; ++k) {
      std::printf("  %s spread / Cramer-Rao %.3f, stated / Cramer-Rao %.3f, bias / Cramer-Rao %+.3f\n",
                  kNames[k], s.deviation[k] / bound[k], s.stated[k] / bound[k], s.bias[k] / bound[k]);
      EXPECT_LT(s.deviation[k] / bound[k], 1.15 + 0.08) << kNames[k];  // 120 seeds know the ratio to 6.5 %
      EXPECT_GT(s.deviation[k] / bound[k], 0.80) << kNames[k];
      EXPECT_LT(std::abs(s.bias[k]) / bound[k], 1.0 / 3.0) << kNames[k];
      // An estimated voltage noise is never negative, so where there is none the stated sigma errs on the
      // large side.
      EXPECT_GT(s.stated[k] / bound[k], 0.95) << kNames[k];
      EXPECT_LT(s.stated[k] / bound[k], 1.15) << kNames[k];
    }
  }
}

TEST(TransientFitTest, IntervalsCoverUnderNoiseOnCurrentVoltageAndSpeed) {
  if (kSlowBuild) GTEST_SKIP() << "statistics are checked in the release build";
  const int seeds = 100;
  struct Condition {
    double slip, filter_s, current_A, voltage_V, speed_rpm;
  };
  const Motor& m = synthetic::motors()[1];
  for (const auto& n : {Condition{0.028, 200e-6, 0.05, 0.0, 0.0}, Condition{0.028, 200e-6, 0.05, 0.5, 0.5},
                        Condition{0.002, 200e-6, 0.05, 0.5, 0.5}}) {
    auto c = synthetic::step_case(m, 0.8, 0.9, n.slip, 60e-6, 4000);
    c.filter_s = n.filter_s;
    const Spread s =
        synthetic::spread_of(m, synthetic::record(m, c), n.current_A, n.voltage_V, rad_s_of_rpm(n.speed_rpm), seeds);
    std::printf("slip %.1f %%, noise %.2f A, %.1f V, %.1f rpm\n", 100.0 * n.slip, n.current_A, n.voltage_V,
                n.speed_rpm);
    print_spread(m, s);
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_GE(s.covered[k], 88) << kNames[k];  // 95 expected, binomial sigma 2.2
      EXPECT_LT(std::abs(s.bias[k]), 0.4 * s.deviation[k]) << kNames[k];
      EXPECT_NEAR(s.stated[k] / s.deviation[k], 1.0, 0.25) << kNames[k];
    }
  }
}

TEST(TransientFitTest, AWrongStatorResistanceMovesTheOthersAsForetold) {
  const Motor& m = synthetic::motors()[1];
  const auto truth = truth_of(m);
  auto c = synthetic::step_case(m, 0.5, 0.5, m.slip, 60e-6, 4000);
  c.filter_s = 200e-6;
  const FrameRecord frame = to_frame(synthetic::record(m, c), m.pole_pairs);
  auto options = options_near(truth, 1.0, 1.0, 1.0);
  const TransientFit right = fit_transient(frame, options);
  options.nominal.R_s *= 1.005;
  const TransientFit wrong = fit_transient(frame, options);
  for (std::size_t k = 0; k < 3; ++k) {
    const double moved = three(wrong.theta)[k] - three(right.theta)[k];
    const double foretold = right.noise.per_R_s[static_cast<Eigen::Index>(k + 1)] * 0.005 * truth.R_s;
    EXPECT_NEAR(moved, foretold, 0.1 * std::abs(foretold) + 1e-5 * three(truth)[k]) << kNames[k];
  }
}

TEST(TransientFitTest, StatorResistanceCanBeAFourthUnknown) {
  const Motor& m = synthetic::motors()[1];
  const auto truth = truth_of(m);
  auto c = synthetic::step_case(m, 0.3, 0.3, 2.0 * m.slip, 60e-6, 5000);
  c.filter_s = 200e-6;
  auto options = options_near(truth, 1.3, 0.8, 0.9);
  options.nominal.R_s *= 1.5;
  options.fit_R_s = true;
  const TransientFit fit = fit_transient(to_frame(synthetic::record(m, c), m.pole_pairs), options);
  ASSERT_EQ(fit.failure, "");
  EXPECT_NEAR(fit.theta.R_s / truth.R_s, 1.0, 2e-3);
}

TEST(TransientFitTest, FaultsOfTheVoltageChannelsAreToldFromTheMachine) {
  const Motor& m = synthetic::motors()[1];
  const auto truth = truth_of(m);
  auto c = synthetic::step_case(m, 0.5, 0.5, m.slip, 60e-6, 5000);
  c.filter_s = 200e-6;
  TimeSeries series = synthetic::record(m, c);
  for (auto& v : series.v) {
    const auto [a, b, n] = phases(v);
    v = space_vector(1.006 * a, b, 0.994 * n) +
        SpaceVector(0.3, -0.2);  // gains that differ between phases, and offsets
  }
  const TransientFit fit = fit_transient(to_frame(series, m.pole_pairs), options_near(truth, 1.0, 1.0, 1.0));
  ASSERT_EQ(fit.failure, "");
  for (std::size_t k = 0; k < 3; ++k)
    EXPECT_NEAR(three(fit.theta)[k] / three(truth)[k], 1.0, 5e-4) << kNames[k];
  EXPECT_LT(fit.nrmse, 1e-3);
}

TEST(TransientFitTest, BoundsAreKeptAndReported) {
  const Motor& m = synthetic::motors()[1];
  auto c = synthetic::step_case(m, 0.8, 0.9, m.slip, 60e-6, 3000);
  c.filter_s = 200e-6;
  const FrameRecord frame = to_frame(synthetic::record(m, c), m.pole_pairs);
  auto options = options_near(truth_of(m), 1.0, 1.0, 1.0 / 4.0);  // the true L_m is 400 % of this nominal
  TransientFit fit = fit_transient(frame, options);
  EXPECT_TRUE(fit.on_bound[3]);
  EXPECT_NEAR(fit.theta.L_m / options.nominal.L_m, kBoundHigh, 1e-3);
  options.bounds_move = true;  // unless the nominal is only a guess
  fit = fit_transient(frame, options);
  EXPECT_FALSE(fit.on_bound[3]);
  EXPECT_NEAR(fit.theta.L_m / truth_of(m).L_m, 1.0, 1e-3);
}

}  // namespace
}  // namespace imrig::est
