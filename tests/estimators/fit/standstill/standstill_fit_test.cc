#include "estimators/fit/standstill/standstill_fit.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "estimators/fit/standstill/gradient_estimator.h"
#include "tests/estimators/fit/standstill/standing_motor.h"

namespace imrig::est {
namespace {

using Values = std::array<double, 4>;

const standing::Motor kPaper{0.56, 0.78, 0.007, 0.007, 0.039};                   // Fang, Lin and Wang 2005
const standing::Motor kProca{0.39, 0.2394118, 0.0030634, 0.0030634, 0.0709366};  // Proca and Keyhani 2002
const standing::Motor kLarge{0.035, 0.021, 0.0004, 0.0004, 0.018};               // 50 kW
const standing::Motor kSmall{8.2, 6.1, 0.021, 0.021, 0.42};                      // 0.5 kW

// R_s, R_r, L_s, L_m of the T circuit.
Values truth(const standing::Motor& m) { return {m.R_s, m.R_r, m.L_ls + m.L_m, m.L_m}; }
Values found(const StandstillFit& f) { return {f.t.R_s, f.t.R_r, f.t.L_ls + f.t.L_m, f.t.L_m}; }
Values sigmas(const StandstillFit& f) { return {f.sigma[0], f.sigma_R_r_t, f.sigma_L_s, f.sigma_L_m_t}; }

StandstillFit fit(const standing::Motor& motor, const standing::Experiment& e,
                  const StandstillFitOptions& options = {}) {
  return fit_standstill(axis_record(standing::record(motor, e), 2), options);
}

StandstillFitOptions declared(const standing::Experiment& e) {
  StandstillFitOptions options;
  options.noise.current_A = e.current_noise_A;
  options.noise.voltage_V = e.voltage_noise_V;
  return options;
}

double worst(const StandstillFit& f, const standing::Motor& m) {
  double out = 0.0;
  for (std::size_t k = 0; k < 4; ++k) out = std::max(out, std::abs(found(f)[k] / truth(m)[k] - 1.0));
  return out;
}

TEST(StandstillFit, FindsTheMotorWithoutNoise) {
  struct Case {
    const standing::Motor& motor;
    double kp, ki;
    std::vector<standing::Tone> tones;
  };
  const Case cases[] = {{kPaper, 1.6, 116.0, {{3, 12}, {4, 25}, {6, 70}}},
                        {kProca, 1.6, 116.0, {{4, 2.5}, {4, 12}, {5, 70}}},
                        {kLarge, 0.1, 7.0, {{40, 1.0}, {40, 5}, {50, 40}}},
                        {kSmall, 15.0, 1500.0, {{1, 10}, {1, 40}, {1, 300}}}};
  for (const Case& c : cases) {
    standing::Experiment e;
    e.tones = c.tones;
    e.kp = c.kp;
    e.ki = c.ki;
    const auto f = fit(c.motor, e);
    EXPECT_EQ(f.failure, "");
    fmt::print("R_s {:.4g} ohm: worst error {:.4f} %, {} steps\n", c.motor.R_s, 100.0 * worst(f, c.motor),
               f.iterations);
    EXPECT_LT(worst(f, c.motor), 1e-3);
  }
}

// The rig's target: 10 s of data, 20 mA of noise: R_s to 0.3 %, R_r, L_s, L_m to 1 %.
TEST(StandstillFit, TenSecondsWith20MilliampereMeetTheTarget) {
  const Values target{0.003, 0.01, 0.01, 0.01};
  Values most{};
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    standing::Experiment e;
    e.seconds = 10.0;
    e.current_noise_A = 0.02;
    e.seed = seed;
    const auto f = fit(kPaper, e, declared(e));
    ASSERT_EQ(f.failure, "");
    for (std::size_t k = 0; k < 4; ++k)
      most[k] = std::max(most[k], std::abs(found(f)[k] / truth(kPaper)[k] - 1.0));
  }
  fmt::print("largest of 20 seeds: R_s {:.3f} %, R_r {:.3f} %, L_s {:.3f} %, L_m {:.3f} %\n", 100 * most[0],
             100 * most[1], 100 * most[2], 100 * most[3]);
  for (std::size_t k = 0; k < 4; ++k) EXPECT_LT(most[k], target[k]) << k;
}

TEST(StandstillFit, BeatsThePublishedEstimatorOnTheSameRecord) {
  standing::Experiment e;
  e.seconds = 10.0;
  e.current_noise_A = 0.02;
  const AxisRecord record = axis_record(standing::record(kPaper, e), 2);
  const auto f = fit_standstill(record, declared(e));
  const auto published = run_gradient(record).circuit();
  ASSERT_TRUE(published);
  const double gradient = std::abs(published->L_m / kPaper.L_m - 1.0);
  fmt::print("10 s, 20 mA: worst {:.2f} %, published L_m {:.1f} % off\n", 100 * worst(f, kPaper),
             100 * gradient);
  EXPECT_LT(20.0 * worst(f, kPaper), gradient);
}

TEST(StandstillFit, IntervalsHoldTheTruthAsOftenAsTheySay) {
  constexpr int kSeeds = 150;
  std::array<int, 4> held{};
  Values sum{}, square{}, stated{};
  double chi2 = 0.0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    standing::Experiment e;
    e.seconds = 3.0;
    e.current_noise_A = 0.02;
    e.voltage_noise_V = 1.0;  // large, so that the bias it brings would show
    e.seed = seed;
    const auto f = fit(kPaper, e, declared(e));
    ASSERT_EQ(f.failure, "");
    chi2 += f.chi2_per_dof / kSeeds;
    for (std::size_t k = 0; k < 4; ++k) {
      const double error = found(f)[k] / truth(kPaper)[k] - 1.0;
      sum[k] += error;
      square[k] += error * error;
      stated[k] += sigmas(f)[k] / kSeeds;
      held[k] += std::abs(error) < 1.96 * sigmas(f)[k] ? 1 : 0;
    }
  }
  EXPECT_NEAR(chi2, 1.0, 0.1);
  for (std::size_t k = 0; k < 4; ++k) {
    const double mean = sum[k] / kSeeds, spread = std::sqrt(square[k] / kSeeds - mean * mean);
    fmt::print("{}: bias {:+.3f} %, spread {:.3f} %, stated {:.3f} %, held {} of {}\n", k, 100 * mean,
               100 * spread, 100 * stated[k], held[k], kSeeds);
    EXPECT_LT(std::abs(mean), spread / 3.0) << k;
    EXPECT_GT(stated[k], 0.85 * spread) << k;
    EXPECT_LT(stated[k], 1.4 * spread) << k;
    EXPECT_GE(held[k], kSeeds * 90 / 100) << k;  // 95 % expected; three sigmas below
  }
}

TEST(StandstillFit, NoiseOfTheVoltageLeavesNoBias) {
  // So much noise that its pull is seen through the spread of few records.
  Values corrected{}, pulled{};
  constexpr int kSeeds = 40;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    standing::Experiment e;
    e.seconds = 10.0;
    e.voltage_noise_V = 6.0;
    e.seed = seed;
    const auto f = fit(kPaper, e);  // nothing declared: the noise is found from the residual
    ASSERT_EQ(f.failure, "");
    const Values theta{f.theta.R_s, f.theta.R_r, f.theta.L_l, f.theta.L_m};
    const auto p = inverse_gamma_of(TCircuit{kPaper.R_s, kPaper.R_r, kPaper.L_ls, kPaper.L_lr, kPaper.L_m});
    const Values right{p.R_s, p.R_r, p.L_l, p.L_m};
    for (std::size_t k = 0; k < 4; ++k) {
      corrected[k] += (theta[k] / right[k] - 1.0) / kSeeds;
      pulled[k] += (theta[k] / right[k] * std::exp(f.noise_bias[k]) - 1.0) / kSeeds;
    }
  }
  for (std::size_t k = 0; k < 4; ++k)
    fmt::print("{}: {:+.2f} % without the correction, {:+.2f} % with it\n", kStandstillNames[k],
               100 * pulled[k], 100 * corrected[k]);
  // L_l is seen best, L_m worst: its mean over these records still scatters by 0.5 %.
  EXPECT_GT(std::abs(pulled[2]), 5.0 * std::abs(corrected[2]));
  EXPECT_GT(std::abs(pulled[1]), 3.0 * std::abs(corrected[1]));
}

TEST(StandstillFit, SensorsZerosBiasAndDirectionOfTheCurrentDoNotMatter) {
  standing::Experiment e;
  const auto plain = fit(kPaper, e);
  e.voltage_zero_V = 0.6;
  e.current_zero_A = -0.15;
  e.axis_rad = 0.7;
  e.offset_A = 5.0;
  const AxisRecord record = axis_record(standing::record(kPaper, e), 2);
  EXPECT_NEAR(record.angle_rad, 0.7, 1e-9);
  const auto f = fit_standstill(record);
  EXPECT_EQ(f.failure, "");
  for (std::size_t k = 0; k < 4; ++k) EXPECT_NEAR(found(f)[k] / found(plain)[k], 1.0, 5e-4) << k;
}

TEST(StandstillFit, ASingleToneIsRefusedAndEveryParameterNamed) {
  standing::Experiment e;
  e.current_noise_A = 0.02;
  e.voltage_noise_V = 0.25;
  e.tones = {{6.0, 70.0}};
  const auto f = fit(kPaper, e, declared(e));
  EXPECT_TRUE(f.failure.starts_with("cannot separate ")) << f.failure;
  for (const char* name : {"R_s", "R_r", "L_m"})
    EXPECT_NE(f.failure.find(name), std::string::npos) << f.failure;
}

TEST(StandstillFit, TonesAboveTheRotorsCornerShowLeakageAloneAndTheRefusalSaysSo) {
  standing::Experiment e;
  e.current_noise_A = 0.02;
  e.voltage_noise_V = 0.25;
  e.tones = {{3.0, 400.0}, {4.0, 600.0}, {5.0, 800.0}};
  const auto f = fit(kPaper, e, declared(e));
  EXPECT_NE(f.failure.find("L_m"), std::string::npos) << f.failure;
  EXPECT_EQ(f.failure.find("L_l"), std::string::npos) << f.failure;
  EXPECT_LT(f.amplification[2], 5.0);
}

TEST(StandstillFit, ThePapersTonesNeedAnotherMeasurementOfRsOnAMotorWithASlowRotor) {
  standing::Experiment e;
  e.current_noise_A = 0.02;
  e.voltage_noise_V = 0.25;
  StandstillFitOptions options = declared(e);
  const auto alone = fit(kProca, e, options);
  EXPECT_NE(alone.failure.find("L_m"), std::string::npos) << alone.failure;
  options.R_s = KnownResistance{1.001 * kProca.R_s, 0.001};
  const auto helped = fit(kProca, e, options);
  ASSERT_EQ(helped.failure, "");
  fmt::print("L_m sigma: {:.1f} % alone, {:.2f} % with R_s to 0.1 %; error {:+.2f} %\n",
             100 * alone.sigma_L_m_t, 100 * helped.sigma_L_m_t, 100 * (helped.t.L_m / kProca.L_m - 1.0));
  EXPECT_LT(helped.sigma_L_m_t, 0.02);
  for (std::size_t k = 0; k < 4; ++k)
    EXPECT_LT(std::abs(found(helped)[k] / truth(kProca)[k] - 1.0), 3.0 * sigmas(helped)[k]) << k;
}

TEST(StandstillFit, ATurningFieldOrATurningShaftIsNoStandstill) {
  standing::Experiment e;
  TimeSeries series = standing::record(kPaper, e);
  TimeSeries turning = series;
  for (double& w : turning.speed_rad_s) w = 1.0;
  EXPECT_NE(axis_record(turning, 2).failure.find("shaft turns"), std::string::npos);
  for (std::size_t k = 0; k < series.size(); ++k) {
    const SpaceVector turn = std::polar(1.0, 20.0 * series.sample_time_s * static_cast<double>(k));
    series.i[k] *= turn;
    series.v[k] *= turn;
  }
  EXPECT_NE(axis_record(series, 2).failure.find("field turns"), std::string::npos);
}

}  // namespace
}  // namespace imrig::est
