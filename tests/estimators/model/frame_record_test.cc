#include "estimators/model/frame_record.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "rig/base/error.h"

namespace imrig::est {
namespace {

using Complex = std::complex<double>;

TimeSeries turning(double f_Hz, double sample_time_s, std::size_t n) {
  TimeSeries s;
  s.sample_time_s = sample_time_s;
  for (std::size_t k = 0; k < n; ++k) {
    const Complex turn = std::polar(1.0, 2.0 * kPi * f_Hz * sample_time_s * static_cast<double>(k));
    s.v.push_back(100.0 * turn);
    s.i.push_back(Complex(3.0, -4.0) * turn);
    s.speed_rad_s.push_back(90.0);
  }
  return s;
}

TEST(FrameRecordTest, ASinusoidStandsStillInItsFrame) {
  for (const double f : {60.0, -35.0}) {
    const FrameRecord r = to_frame(turning(f, 1e-3, 500), 2);
    EXPECT_NEAR(r.w_k, 2.0 * kPi * f, 1e-9);
    EXPECT_NEAR(std::abs(r.v[499] - 100.0), 0.0, 1e-8);
    EXPECT_NEAR(std::abs(r.i[250] - Complex(3.0, -4.0)), 0.0, 1e-8);
    EXPECT_EQ(r.w_r[7], 180.0);
  }
}

TEST(FrameRecordTest, MatchedFilterActsOnASinusoidAsTheAnalogOne) {
  for (const double h : {20e-6, 60e-6, 1e-3}) {
    TimeSeries s = turning(60.0, h, 2000);
    s.voltage_filter_s = 250e-6;
    const FrameRecord r = to_frame(s, 2);
    const Complex expected = Complex(3.0, -4.0) / Complex(1.0, 2.0 * kPi * 60.0 * 250e-6);
    EXPECT_NEAR(std::abs(r.i[r.judged_from] - expected), 0.0, 1e-9) << h;
    EXPECT_NEAR(std::abs(r.i.back() - expected), 0.0, 1e-9) << h;
    EXPECT_EQ(r.judged_from, static_cast<std::size_t>(std::ceil(2e-3 / h))) << h;
  }
}

TEST(FrameRecordTest, MatchedFilterOfAStepIsTheExponential) {
  TimeSeries s;
  s.sample_time_s = 50e-6;
  s.voltage_filter_s = 400e-6;
  for (std::size_t k = 0; k < 400; ++k) {
    s.v.push_back(1.0);  // stands still: the frame does not turn
    s.i.push_back(k < 200 ? 0.0 : 1.0);
    s.speed_rad_s.push_back(0.0);
  }
  const FrameRecord r = to_frame(s, 2);
  // The straight line from sample 199 to 200 is a ramp of length h; behind it, the exact response to that
  // ramp.
  const double h = 50e-6, tau = 400e-6;
  const double ramp = tau / h * (1.0 - std::exp(-h / tau));
  for (const std::size_t k : {200UL, 205UL, 230UL}) {
    const double t = static_cast<double>(k - 200) * h;
    EXPECT_NEAR(r.i[k].real(), 1.0 - ramp * std::exp(-t / tau), 1e-12) << k;
  }
}

TEST(FrameRecordTest, NoiseGainIsWhatTheFilterDoesToWhiteNoise) {
  TimeSeries s = turning(60.0, 60e-6, 40000);
  s.voltage_filter_s = 200e-6;
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal(0.0, 0.1);
  for (auto& i : s.i) i = Complex(normal(random), normal(random));
  const FrameRecord r = to_frame(s, 2);
  double power = 0.0;
  for (std::size_t k = r.judged_from; k < r.size(); ++k)
    power += std::norm(r.i[k]) / 2.0 / static_cast<double>(r.size() - r.judged_from);
  EXPECT_NEAR(std::sqrt(power) / 0.1, r.noise_gain, 0.03 * r.noise_gain);
}

TEST(FrameRecordTest, KeepsTheLongestStretchWithGatesOn) {
  TimeSeries s = turning(60.0, 60e-6, 1000);
  s.gates_on.assign(1000, 1);
  for (std::size_t k = 0; k < 100; ++k) s.gates_on[k] = 0;
  s.gates_on[900] = 0;
  const FrameRecord r = to_frame(s, 2);
  EXPECT_EQ(r.first, 100U);
  EXPECT_EQ(r.size(), 800U);
}

TEST(FrameRecordTest, BadSeriesAreRefusedWithAReason) {
  TimeSeries missing = turning(60.0, 60e-6, 100);
  missing.i[50] = {std::numeric_limits<double>::quiet_NaN(), 0.0};
  EXPECT_THROW(to_frame(missing, 2), Error);
  TimeSeries uneven = turning(60.0, 60e-6, 100);
  uneven.v.pop_back();
  EXPECT_THROW(to_frame(uneven, 2), Error);
  TimeSeries off = turning(60.0, 60e-6, 100);
  off.gates_on.assign(100, 0);
  EXPECT_THROW(to_frame(off, 2), Error);
  TimeSeries slow = turning(60.0, 60e-6, 100);
  slow.voltage_filter_s = 1.0;
  EXPECT_THROW(to_frame(slow, 2), Error);
  TimeSeries timeless = turning(60.0, 60e-6, 100);
  timeless.sample_time_s = kMissing;
  EXPECT_THROW(to_frame(timeless, 2), Error);
}

// The integral of exp(jwt) over a sample is (2/(wh)) tan(wh/2) of what a straight line between its samples
// has.
TEST(Straighten, GivesLinesTheIntegralOfACurve) {
  for (const double turn : {0.1, -0.4, 0.75, -1.1}) {
    std::vector<Complex> v;
    for (int k = 0; k < 400; ++k) v.push_back(100.0 + 3.0 * std::polar(1.0, turn * k));
    const std::vector<Complex> samples = v;
    straighten(v);
    const double wanted = std::tan(0.5 * turn) / (0.5 * turn);
    for (std::size_t k = 10; k < 390; ++k) {
      const Complex gain = (v[k] - 100.0) / (samples[k] - 100.0);
      EXPECT_NEAR(gain.real(), wanted, 0.12 * (wanted - 1.0) + 1e-9) << turn;
      EXPECT_NEAR(gain.imag(), 0.0, 1e-9);
    }
  }
}

TEST(Straighten, LeavesNoiseAndStepsAsTheyAre) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  std::vector<Complex> v;
  for (int k = 0; k < 2000; ++k)
    v.push_back(Complex(k < 1000 ? 100.0 : 120.0, 0.0) + 0.3 * Complex(normal(random), normal(random)));
  const std::vector<Complex> samples = v;
  straighten(v);
  double moved = 0.0;
  for (std::size_t k = 0; k < v.size(); ++k) moved += std::norm(v[k] - samples[k]) / 2000.0;
  EXPECT_LT(std::sqrt(moved), 0.02 * 0.3 * std::sqrt(2.0));
  std::vector<Complex> step(100, 100.0);
  std::fill(step.begin() + 50, step.end(), 120.0);
  const std::vector<Complex> before = step;
  straighten(step);
  EXPECT_EQ(step, before);
}

}  // namespace
}  // namespace imrig::est
