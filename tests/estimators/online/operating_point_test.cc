#include "estimators/online/operating_point.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>

#include "rig/base/error.h"
#include "tests/estimators/online/synthetic.h"

namespace imrig::est {
namespace {

double power_of(const Signal& s) { return 1.5 * s.V * s.I * std::cos(s.phi_rad); }

// Of the phase slope between two halves in white noise alone: sqrt(8) s/(A N^1.5), s the vector noise's rms.
double expected_sigma_Hz(const Signal& s, const OperatingPoint& p) {
  const auto N = static_cast<double>(p.last_index - p.first_index + 1);
  const double noise_V = std::hypot(s.v_noise_V, s.v_scale / std::sqrt(12.0)) * 2.0 / std::sqrt(3.0);
  return std::sqrt(8.0) * noise_V / (s.V * std::pow(N, 1.5)) / (2 * std::numbers::pi * s.sample_time_s);
}

// A bench-like signal at constant volts per hertz, with everything that is not ideal.
Signal bench(double f_Hz) {
  Signal s;
  s.f_Hz = f_Hz;
  s.V = 8.0 + 2.8 * std::abs(f_Hz);
  s.speed_rpm = 60.0 * f_Hz / 2.0 * 0.97;
  s.harmonic5 = 0.02;
  s.harmonic7 = 0.01;
  s.v_zero_V = 0.8;
  s.i_zero_A = 0.15;
  s.v_noise_V = 0.3;
  s.i_noise_A = 0.03;
  s.filter_s = 60e-6;
  return s;
}

TEST(OperatingPoint, FrequencyPhasorsSlipAndPowerAreFoundFrom1To120HzInBothPhaseOrders) {
  fmt::print("{:>9} {:>12} {:>12} {:>11} {:>11} {:>11} {:>11} {:>11}\n", "f Hz", "df/f", "df/sigma", "dV/V",
             "dI/I", "dphi rad", "dP/P", "dslip");
  for (const double f : {1.0, 2.7, 5.0, 9.3, 17.0, 30.0, 43.21, 50.0, 60.0, 80.0, 97.7, 120.0}) {
    for (const double sense : {1.0, -1.0}) {
      const Signal s = bench(sense * f);
      const std::vector<OperatingPoint> points = estimate(s, f < 3.0 ? 9.0 : 2.0);
      ASSERT_GE(points.size(), 3u);
      const OperatingPoint& p = points.back();
      ASSERT_TRUE(p.valid) << f;
      const double df = p.frequency_Hz - s.f_Hz;
      fmt::print("{:9.2f} {:12.2e} {:12.2f} {:11.1e} {:11.1e} {:11.1e} {:11.1e} {:11.1e}\n", s.f_Hz,
                 df / s.f_Hz, df / p.sigma_frequency_Hz, p.voltage_V / s.V - 1, p.current_A / s.I - 1,
                 p.phi_rad - s.phi_rad, p.input_power_W / power_of(s) - 1, p.slip - 0.03);
      for (const OperatingPoint& each : points) {
        EXPECT_LE(std::abs(each.frequency_Hz - s.f_Hz), 5.0 * each.sigma_frequency_Hz) << f;
        EXPECT_NEAR(each.frequency_Hz, s.f_Hz, 5.0 * expected_sigma_Hz(s, each) + 2e-6 * f);
        EXPECT_NEAR(each.voltage_V, s.V, 1e-3 * s.V);
        EXPECT_NEAR(each.current_A, s.I, 1e-3 * s.I);
        EXPECT_NEAR(each.phi_rad, s.phi_rad, 1e-3);
        EXPECT_NEAR(each.input_power_W, power_of(s), 2e-3 * power_of(s));
        EXPECT_NEAR(each.slip, 0.03, 2e-4);
        EXPECT_NEAR(each.speed_rpm, s.speed_rpm, 0.2 * 1e-3 * std::abs(s.speed_rpm));
      }
      EXPECT_TRUE(p.steady) << f;
    }
  }
}

TEST(OperatingPoint, FrequencySpreadIsThatOfTheBoundForTwoHalves) {
  Signal s;
  s.v_noise_V = 6.0;
  s.v_scale = 0.05;
  double square = 0.0, sigma = 0.0;
  int n = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    s.seed = seed;
    for (const OperatingPoint& p : estimate(s, 0.85)) {
      square += std::pow(p.frequency_Hz - s.f_Hz, 2);
      sigma += p.sigma_frequency_Hz;
      ++n;
    }
  }
  // Vector noise of phase noise sigma: rms sigma * 2/sqrt(3). Bound for N samples: 6 s^2/(A^2 N^3), two
  // halves: 4/3 of it.
  const double N = 0.2 / s.sample_time_s;
  const double noise = s.v_noise_V * 2.0 / std::sqrt(3.0);
  const double bound_Hz =
      std::sqrt(6.0) * noise / (s.V * std::pow(N, 1.5)) / (2 * std::numbers::pi * s.sample_time_s);
  const double measured_Hz = std::sqrt(square / n);
  fmt::print(
      "one sigma of the frequency: measured {:.3g} Hz, stated {:.3g} Hz, Cramer-Rao {:.3g} Hz ({} windows)\n",
      measured_Hz, sigma / n, bound_Hz, n);
  ASSERT_GE(n, 160);
  EXPECT_GT(measured_Hz, 0.9 * bound_Hz);
  EXPECT_LT(measured_Hz, 1.4 * bound_Hz);  // sqrt(4/3) = 1.15, and the spread of 160 windows
  EXPECT_NEAR(sigma / n, std::sqrt(4.0 / 3.0) * bound_Hz, 0.05 * bound_Hz);
}

TEST(OperatingPoint, TheVoltageFilterIsUndoneInAmplitudePhaseAndPower) {
  Signal s;
  s.f_Hz = 100.0;
  s.phi_rad = 1.3;  // where a lag of the voltage counts most
  s.filter_s = 240e-6;
  const OperatingPoint p = estimate(s, 0.5).back();
  EXPECT_NEAR(p.voltage_V, s.V, 1e-4 * s.V);
  EXPECT_NEAR(p.phi_rad, s.phi_rad, 1e-4);
  EXPECT_NEAR(p.input_power_W, power_of(s), 1e-3 * power_of(s));
}

TEST(OperatingPoint, HarmonicPowerIsPartOfTheInputPower) {
  Signal s;
  s.harmonic5 = 0.2;
  const OperatingPoint p = estimate(s, 0.5).back();
  const double fifth_W = 1.5 * (0.2 * s.V) * (0.02 * s.I) * std::cos(0.3 + 1.0);
  EXPECT_NEAR(p.input_power_W, power_of(s) + fifth_W, 0.2 * std::abs(fifth_W));
  EXPECT_NEAR(p.voltage_V, s.V, 1e-4 * s.V);
}

TEST(OperatingPoint, CurrentThatLeadsHasANegativePhaseInBothOrders) {
  for (const double f : {40.0, -40.0}) {
    Signal s;
    s.f_Hz = f;
    s.phi_rad = -0.9;
    EXPECT_NEAR(estimate(s, 0.5).back().phi_rad, -0.9, 1e-3);
  }
}

TEST(OperatingPoint, AGeneratingMotorTakesNegativePower) {
  Signal s;
  s.phi_rad = 2.5;
  s.speed_rpm = 1530.0;
  const OperatingPoint p = estimate(s, 0.5).back();
  EXPECT_NEAR(p.input_power_W, power_of(s), 2e-3 * std::abs(power_of(s)));
  EXPECT_NEAR(p.slip, -0.02, 1e-4);
}

TEST(OperatingPoint, WindowsFollowEachOtherAndHoldWholePeriods) {
  Signal s = bench(43.21);
  const std::vector<OperatingPoint> points = estimate(s, 3.0);
  ASSERT_GE(points.size(), 10u);
  for (std::size_t k = 0; k < points.size(); ++k) {
    const auto n = static_cast<double>(points[k].last_index - points[k].first_index + 1);
    const double periods = n * s.sample_time_s * s.f_Hz;
    EXPECT_NEAR(periods, std::round(periods), 0.6 * s.sample_time_s * s.f_Hz);
    EXPECT_GE(periods, 2.0 - 1e-2);
    EXPECT_EQ(points[k].utime, points[k].last_index * 60);
    EXPECT_EQ(points[k].gaps, 0);
    if (k > 0) {
      EXPECT_EQ(points[k].first_index, points[k - 1].last_index + 1);
    }
  }
}

TEST(OperatingPoint, SteadyNeedsThreeWindowsThatAgree) {
  const std::vector<OperatingPoint> points = estimate(bench(50.0), 1.5);
  ASSERT_GE(points.size(), 5u);
  EXPECT_FALSE(points[0].steady);
  EXPECT_FALSE(points[1].steady);
  for (std::size_t k = 2; k < points.size(); ++k) EXPECT_TRUE(points[k].steady) << k;
}

TEST(OperatingPoint, ARampOfFrequencyIsNeverSteady) {
  for (const double Hz_per_s : {0.1, 1.0, 10.0}) {
    Signal s = bench(50.0);
    s.angle = [&](double t) { return 2 * std::numbers::pi * (50.0 * t + 0.5 * Hz_per_s * t * t); };
    const std::vector<OperatingPoint> points = estimate(s, 2.0);
    ASSERT_GE(points.size(), 8u);
    for (const OperatingPoint& p : points) {
      EXPECT_TRUE(p.valid);
      EXPECT_FALSE(p.steady) << Hz_per_s << " Hz/s";
    }
    const double middle_s = 0.5 * 60e-6 * static_cast<double>(points[4].first_index + points[4].last_index);
    EXPECT_NEAR(points[4].frequency_Hz, 50.0 + Hz_per_s * middle_s, 2e-3 + 2e-3 * Hz_per_s);
  }
}

TEST(OperatingPoint, ARampOfVoltageIsNotSteadyAndItsEndIs) {
  Signal s = bench(50.0);
  s.amplitude = [](double t) { return std::min(0.5 + 0.25 * t, 1.0); };  // until 2 s
  for (const OperatingPoint& p : estimate(s, 4.0)) {
    const double begin_s = 60e-6 * static_cast<double>(p.first_index),
                 end_s = 60e-6 * static_cast<double>(p.last_index);
    if (end_s < 2.0) {
      EXPECT_FALSE(p.steady) << end_s;
    }
    if (begin_s > 2.45) {
      EXPECT_TRUE(p.steady) << begin_s;
    }
  }
}

TEST(OperatingPoint, AnExponentialSettlingIsSteadyOnlyNearItsEnd) {
  Signal s;
  s.v_noise_V = 0.1;
  s.i_noise_A = 0.01;
  constexpr double kT_s = 0.3;
  s.amplitude = [](double t) { return 1.0 - 0.3 * std::exp(-t / kT_s); };
  bool ever = false;
  for (const OperatingPoint& p : estimate(s, 4.0)) {
    if (!p.steady) continue;
    ever = true;
    EXPECT_NEAR(p.current_A, s.I, 3e-3 * s.I);
    EXPECT_NEAR(p.voltage_V, s.V, 3e-3 * s.V);
  }
  EXPECT_TRUE(ever);
}

TEST(OperatingPoint, GatesOffIsInvalidButHasASpeed) {
  Signal s = bench(50.0);
  const std::size_t n = 20000;
  const Samples x = make_samples(s, n);
  std::vector<OperatingPoint> points;
  OperatingPointEstimator estimator({}, [&](const OperatingPoint& p) { points.push_back(p); });
  SampleBlock off = block_of(s, x, 0, n, 0);
  off.gates_on = false;
  ASSERT_TRUE(estimator.feed(off));
  ASSERT_GE(points.size(), 5u);
  for (const OperatingPoint& p : points) {
    EXPECT_FALSE(p.valid);
    EXPECT_FALSE(p.steady);
    EXPECT_TRUE(std::isnan(p.frequency_Hz));
    EXPECT_TRUE(std::isnan(p.slip));
    EXPECT_NEAR(p.speed_rpm, s.speed_rpm, 0.1);
  }
}

TEST(OperatingPoint, NoWindowReachesOverASwitchOfTheGates) {
  Signal s = bench(50.0);
  const std::size_t n = 20000, switched = 10007;
  const Samples x = make_samples(s, n);
  std::vector<OperatingPoint> points;
  OperatingPointEstimator estimator({}, [&](const OperatingPoint& p) { points.push_back(p); });
  SampleBlock off = block_of(s, x, 0, switched, 0);
  off.gates_on = false;
  estimator.feed(off);
  estimator.feed(block_of(s, x, switched, n - switched, switched));
  int valid = 0;
  for (const OperatingPoint& p : points) {
    EXPECT_EQ(p.valid, p.first_index >= static_cast<std::int64_t>(switched));
    EXPECT_TRUE(p.last_index < static_cast<std::int64_t>(switched) ||
                p.first_index >= static_cast<std::int64_t>(switched));
    valid += p.valid ? 1 : 0;
  }
  EXPECT_GE(valid, 2);
}

TEST(OperatingPoint, DcAndSilenceAreInvalid) {
  Signal s;
  s.angle = [](double) { return 0.4; };
  const std::vector<OperatingPoint> dc = estimate(s, 11.0);
  ASSERT_GE(dc.size(), 2u);
  for (const OperatingPoint& p : dc) EXPECT_FALSE(p.valid);
  s.V = 0.0;
  s.v_noise_V = 0.1;
  const std::vector<OperatingPoint> silence = estimate(s, 11.0);
  ASSERT_GE(silence.size(), 2u);
  for (const OperatingPoint& p : silence) EXPECT_FALSE(p.valid);
}

TEST(OperatingPoint, NoiseAloneIsNoFundamental) {
  Signal s;
  s.V = 0.0;
  s.v_noise_V = 20.0;
  for (const OperatingPoint& p : estimate(s, 11.0)) EXPECT_FALSE(p.valid);
}

std::vector<std::uint64_t> bits(const std::vector<OperatingPoint>& points) {
  std::vector<std::uint64_t> all;
  for (const OperatingPoint& p : points) {
    for (const double x :
         {p.frequency_Hz, p.speed_rpm, p.slip, p.voltage_V, p.current_A, p.phi_rad, p.input_power_W}) {
      all.push_back(std::bit_cast<std::uint64_t>(x));
    }
    for (const std::int64_t x :
         {p.first_index, p.last_index, p.utime, p.gaps, std::int64_t{p.valid}, std::int64_t{p.steady}}) {
      all.push_back(static_cast<std::uint64_t>(x));
    }
  }
  return all;
}

TEST(OperatingPoint, AnyCutIntoBlocksGivesTheSameBits) {
  Signal s = bench(37.0);
  s.angle = [](double t) { return 2 * std::numbers::pi * (37.0 * t + 0.5 * t * t); };
  const auto whole = bits(estimate(s, 3.0, 256));
  ASSERT_GE(whole.size(), 100u);
  EXPECT_EQ(bits(estimate(s, 3.0, 1)), whole);
  EXPECT_EQ(bits(estimate(s, 3.0, 97)), whole);
  EXPECT_EQ(bits(estimate(s, 3.0, 49000)), whole);
}

TEST(OperatingPoint, AGapIsCountedAndTheNextWindowsAreRight) {
  Signal s = bench(50.0);
  const std::size_t n = 40000;
  const Samples x = make_samples(s, n);
  std::vector<OperatingPoint> points;
  OperatingPointEstimator estimator({}, [&](const OperatingPoint& p) { points.push_back(p); });
  for (std::size_t at = 0; at < n; at += 200) {
    if (at == 14000 || at == 14200 || at == 30000) continue;
    EXPECT_TRUE(estimator.feed(block_of(s, x, at, 200, static_cast<std::int64_t>(at))));
  }
  std::int64_t gaps = 0;
  for (const OperatingPoint& p : points) {
    gaps += p.gaps;
    EXPECT_TRUE(p.valid);
    EXPECT_NEAR(p.frequency_Hz, 50.0, 1e-3);
    EXPECT_NEAR(p.speed_rpm, s.speed_rpm, 0.1);
    EXPECT_FALSE(p.first_index < 14000 && p.last_index >= 14000);
    if (p.gaps > 0) {
      EXPECT_FALSE(p.steady);
    }
  }
  EXPECT_EQ(gaps, 600);
  EXPECT_GE(points.size(), 9u);
}

TEST(OperatingPoint, ARebootStartsAnewAndOldBlocksArePassedOver) {
  Signal s = bench(50.0);
  const Samples x = make_samples(s, 8000);
  std::vector<OperatingPoint> points;
  OperatingPointEstimator estimator({}, [&](const OperatingPoint& p) { points.push_back(p); });
  EXPECT_TRUE(estimator.feed(block_of(s, x, 0, 4000, 500000)));
  EXPECT_FALSE(estimator.feed(block_of(s, x, 0, 4000, 500000)));
  EXPECT_EQ(estimator.read_index(), 504000);
  SampleBlock reborn = block_of(s, x, 0, 8000, 0);
  reborn.boot_id = 78;
  EXPECT_TRUE(estimator.feed(reborn));
  EXPECT_EQ(estimator.boot_id(), 78);
  EXPECT_EQ(estimator.read_index(), 8000);
  ASSERT_EQ(points.size(), 3u);
  EXPECT_EQ(points[1].boot_id, 78);
  EXPECT_EQ(points[1].first_index, 0);
  EXPECT_EQ(points[1].gaps, 0);
}

TEST(OperatingPoint, MalformedBlocksAreRefused) {
  Signal s = bench(50.0);
  const Samples x = make_samples(s, 100);
  OperatingPointEstimator estimator({}, [](const OperatingPoint&) { FAIL(); });
  const auto refused = [&](auto change) {
    SampleBlock b = block_of(s, x, 0, 100, 0);
    change(b);
    return !estimator.feed(b);
  };
  EXPECT_TRUE(refused([](SampleBlock& b) { b.v_b = b.v_b.first(99); }));
  EXPECT_TRUE(refused([](SampleBlock& b) { b.encoder = {}; }));
  EXPECT_TRUE(refused([](SampleBlock& b) { b.sample_time_ns = 0; }));
  EXPECT_TRUE(refused([](SampleBlock& b) { b.sample_time_ns = INT64_MAX; }));
  EXPECT_TRUE(refused([](SampleBlock& b) { b.first_index = -1; }));
  EXPECT_TRUE(refused([](SampleBlock& b) { b.first_index = INT64_MAX - 5; }));
  EXPECT_TRUE(refused([](SampleBlock& b) { b.voltage_V_per_count = NAN; }));
  EXPECT_TRUE(refused([](SampleBlock& b) { b.current_A_per_count = INFINITY; }));
  EXPECT_TRUE(refused([](SampleBlock& b) { b.voltage_filter_s = NAN; }));
  EXPECT_FALSE(refused([](SampleBlock&) {}));
}

TEST(OperatingPoint, TheEncoderMayWrapAndMayBeMissing) {
  Signal s = bench(50.0);
  const std::size_t n = 8000;
  Samples x = make_samples(s, n);
  for (std::int32_t& count : x.encoder) {
    count = static_cast<std::int32_t>(static_cast<std::uint32_t>(count) + 0x7FFFFFFFu - 900u);
  }
  std::vector<OperatingPoint> points;
  OperatingPointEstimator estimator({}, [&](const OperatingPoint& p) { points.push_back(p); });
  estimator.feed(block_of(s, x, 0, n, 0));
  ASSERT_FALSE(points.empty());
  EXPECT_NEAR(points[0].speed_rpm, s.speed_rpm, 0.1);
  s.counts_per_rev = 0;
  points.clear();
  OperatingPointEstimator blind({}, [&](const OperatingPoint& p) { points.push_back(p); });
  blind.feed(block_of(s, x, 0, n, 0));
  ASSERT_FALSE(points.empty());
  EXPECT_TRUE(points[0].valid);
  EXPECT_TRUE(std::isnan(points[0].slip));
}

TEST(OperatingPoint, AConfigurationOutOfRangeIsRefused) {
  const auto sink = [](const OperatingPoint&) {};
  EXPECT_THROW(OperatingPointEstimator({.pole_pairs = 0}, sink), Error);
  EXPECT_THROW(OperatingPointEstimator({.window_s = 0.0}, sink), Error);
  EXPECT_THROW(OperatingPointEstimator({.lowest_Hz = NAN}, sink), Error);
  EXPECT_THROW(OperatingPointEstimator({.least_voltage_V = 0.0}, sink), Error);
}

}  // namespace
}  // namespace imrig::est
