#include "rig/safety/limits.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "rig/base/space_vector.h"

namespace imrig {
namespace {

using imrig_msg::samples_t;

constexpr double kA_per_count = 0.02;
constexpr int kCountsPerRev = 4096;

LimitsConfig limits() {
  LimitsConfig limits;
  limits.current_A = 10.0;
  limits.speed_rpm = 1000.0;
  limits.stator_C = 100.0;
  return limits;
}

samples_t block(std::int64_t first_index, std::size_t n, double stator_C = 20.0) {
  samples_t s = {};
  s.samples_v1 = 1;
  s.boot_id = 9;
  s.first_index = first_index;
  s.sample_time_ns = 60'000;
  s.current_A_per_count = static_cast<float>(kA_per_count);
  s.full_scale_counts = 2047;
  s.encoder_counts_per_rev = kCountsPerRev;
  s.stator_C = static_cast<float>(stator_C);
  s.n = static_cast<std::int32_t>(n);
  for (auto* channel : {&s.i_a, &s.i_b, &s.i_c, &s.v_a, &s.v_b, &s.v_c}) channel->resize(n);
  s.encoder.resize(n);
  return s;
}

void put_current(samples_t& s, std::size_t k, SpaceVector i_A) {
  const auto abc = phases(i_A);
  s.i_a[k] = static_cast<std::int16_t>(std::lround(abc[0] / kA_per_count));
  s.i_b[k] = static_cast<std::int16_t>(std::lround(abc[1] / kA_per_count));
  s.i_c[k] = static_cast<std::int16_t>(std::lround(abc[2] / kA_per_count));
}

void put_speed(samples_t& s, double rpm, std::uint32_t from = 0) {
  for (std::size_t k = 0; k < s.encoder.size(); ++k) {
    const double t_s = static_cast<double>(s.first_index + static_cast<std::int64_t>(k)) * 60e-6;
    const auto counts = static_cast<std::int64_t>(std::floor(rpm / 60.0 * t_s * kCountsPerRev));
    s.encoder[k] = static_cast<std::int32_t>(from + static_cast<std::uint32_t>(counts));
  }
}

TEST(LimitMonitor, QuietBlockTripsNothing) {
  LimitMonitor monitor(limits());
  const BlockExtremes got = monitor.check(block(0, 256));
  EXPECT_EQ(got.trip, Trip::kNone);
  EXPECT_EQ(got.current_A, 0.0);
  EXPECT_NEAR(got.stator_C, 20.0, 1e-5);
}

TEST(LimitMonitor, CurrentIsJudgedByTheSpaceVectorInEveryDirection) {
  for (int degrees = 0; degrees < 360; degrees += 5) {
    const SpaceVector direction = std::polar(1.0, degrees * kPi / 180.0);
    samples_t s = block(1000, 256);
    put_current(s, 77, 9.9 * direction);
    const BlockExtremes under = LimitMonitor(limits()).check(s);
    EXPECT_EQ(under.trip, Trip::kNone) << degrees;
    EXPECT_NEAR(under.current_A, 9.9, 0.02) << degrees;
    EXPECT_EQ(under.current_index, 1077) << degrees;
    put_current(s, 201, 10.1 * direction);
    const BlockExtremes over = LimitMonitor(limits()).check(s);
    EXPECT_EQ(over.trip, Trip::kOverCurrent) << degrees;
    EXPECT_EQ(over.current_index, 1201) << degrees;
  }
}

TEST(LimitMonitor, ClippedChannelCountsAsOverTheLimit) {
  for (const int clipped : {2047, -2047, -2048, 32767, -32768}) {
    samples_t s = block(0, 4);
    for (auto* channel : {&s.i_a, &s.i_b, &s.i_c})
      (*channel)[2] = static_cast<std::int16_t>(clipped);  // no space vector at all
    const BlockExtremes got = LimitMonitor(limits()).check(s);
    EXPECT_TRUE(got.current_clipped) << clipped;
    EXPECT_EQ(got.trip, Trip::kOverCurrent) << clipped;
  }
}

TEST(LimitMonitor, ScaleThatIsNoNumberTrips) {
  samples_t s = block(0, 4);
  put_current(s, 1, {1.0, 0.0});
  s.current_A_per_count = std::nanf("");
  EXPECT_EQ(LimitMonitor(limits()).check(s).trip, Trip::kOverCurrent);
}

TEST(LimitMonitor, SpeedIsMeasuredAcrossBlocksOfAnyLength) {
  for (const std::size_t n : {1u, 3u, 50u, 256u}) {
    for (const double rpm : {-990.0, -300.0, 0.0, 60.0, 990.0}) {
      LimitMonitor monitor(limits());
      BlockExtremes got;
      for (std::int64_t index = 0; index < 1000; index += static_cast<std::int64_t>(n)) {
        samples_t s = block(index, n);
        put_speed(s, rpm);
        got = monitor.check(s);
        ASSERT_EQ(got.trip, Trip::kNone) << n << " " << rpm;
      }
      EXPECT_NEAR(got.speed_rpm, rpm, 60.0 / kCountsPerRev / 4e-3) << n;  // one count over one window
    }
  }
}

TEST(LimitMonitor, OverSpeedTripsInBothDirectionsWithinTwoWindows) {
  for (const double rpm : {-1010.0, 1010.0}) {
    LimitMonitor monitor(limits());
    samples_t s = block(0, 140);  // 8.4 ms
    put_speed(s, rpm);
    EXPECT_EQ(monitor.check(s).trip, Trip::kOverSpeed) << rpm;
  }
}

TEST(LimitMonitor, EncoderWrapIsNoOverSpeed) {
  LimitMonitor monitor(limits());
  for (std::int64_t index = 0; index < 2560; index += 256) {
    samples_t s = block(index, 256);
    put_speed(s, 900.0, 0x7fffffffu - 300u);
    ASSERT_EQ(monitor.check(s).trip, Trip::kNone) << index;
  }
}

TEST(LimitMonitor, LostBlocksDoNotFakeASpeed) {
  LimitMonitor monitor(limits());
  for (const std::int64_t index : {0, 256, 5120, 5376}) {
    samples_t s = block(index, 256);
    put_speed(s, 950.0);
    const BlockExtremes got = monitor.check(s);
    ASSERT_EQ(got.trip, Trip::kNone) << index;
  }
}

TEST(LimitMonitor, RebootedDeviceStartsTheEncoderAnew) {
  LimitMonitor monitor(limits());
  samples_t s = block(1'000'000, 256);
  put_speed(s, 900.0);
  monitor.check(s);
  samples_t after = block(0, 256);
  after.boot_id = 10;
  EXPECT_EQ(monitor.check(after).trip, Trip::kNone);
}

TEST(LimitMonitor, HotWindingTrips) {
  EXPECT_EQ(LimitMonitor(limits()).check(block(0, 16, 99.9)).trip, Trip::kNone);
  EXPECT_EQ(LimitMonitor(limits()).check(block(0, 16, 100.1)).trip, Trip::kOverTemperature);
}

TEST(LimitMonitor, RigWithoutAThermocoupleRuns) {
  LimitMonitor monitor(limits());
  for (std::int64_t index = 0; index < 40'000; index += 256) {
    ASSERT_EQ(monitor.check(block(index, 256, std::nan(""))).trip, Trip::kNone);
  }
}

TEST(LimitMonitor, ThermocoupleThatBreaksCountsAsHotAfterASecond) {
  LimitMonitor monitor(limits());
  EXPECT_EQ(monitor.check(block(0, 256)).trip, Trip::kNone);
  std::int64_t index = 256;
  while (monitor.check(block(index, 256, std::nan(""))).trip == Trip::kNone) {
    index += 256;
    ASSERT_LT(index, 100'000);
  }
  EXPECT_NEAR(static_cast<double>(index) * 60e-6, 1.0, 0.05);
}

}  // namespace
}  // namespace imrig
