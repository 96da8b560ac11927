#include "rig/dyno/shaft_speed.h"

#include <gtest/gtest.h>

#include <cmath>

namespace imrig {
namespace {

imrig_msg::samples_t block(std::int64_t first, int n, double rpm, std::int64_t boot = 1,
                           std::uint32_t offset = 0) {
  imrig_msg::samples_t m = {};
  m.boot_id = boot;
  m.first_index = first;
  m.sample_time_ns = 60'000;
  m.encoder_counts_per_rev = 4096;
  m.n = n;
  for (std::int64_t k = first; k < first + n; ++k) {
    const auto counts =
        static_cast<std::int64_t>(std::floor(static_cast<double>(k) * 60e-6 * rpm / 60.0 * 4096));
    m.encoder.push_back(static_cast<std::int32_t>(static_cast<std::uint32_t>(counts) + offset));
  }
  return m;
}

TEST(ShaftSpeed, IsTheMeanOverTwentyMillisecondsAndMore) {
  for (const double rpm : {1480.0, -900.0, 0.0}) {
    ShaftSpeed speed;
    EXPECT_TRUE(std::isnan(speed.rpm()));
    for (std::int64_t at = 0; at < 4096; at += 256) speed.take(block(at, 256, rpm));
    EXPECT_NEAR(speed.rpm(), rpm, 60.0 / 4096 / 0.02);  // one count
    EXPECT_EQ(speed.utime(), 4095 * 60);
  }
}

TEST(ShaftSpeed, TheCounterMayWrap) {
  ShaftSpeed speed;
  for (std::int64_t at = 0; at < 4096; at += 256) speed.take(block(at, 256, 1480.0, 1, 0x7FFFFF00u));
  EXPECT_NEAR(speed.rpm(), 1480.0, 1.0);
}

TEST(ShaftSpeed, ARebootStartsAnewAndOldBlocksAreIgnored) {
  ShaftSpeed speed;
  for (std::int64_t at = 100'000; at < 104'096; at += 256) speed.take(block(at, 256, 1480.0));
  const std::int64_t utime = speed.utime();
  speed.take(block(0, 256, -300.0));
  EXPECT_EQ(speed.utime(), utime);
  speed.take(block(0, 256, -300.0, 2));
  EXPECT_EQ(speed.utime(), 255 * 60);
  EXPECT_TRUE(std::isnan(speed.rpm()));
}

TEST(ShaftSpeed, AbsurdNumbersFromTheWireAreIgnored) {
  ShaftSpeed speed;
  imrig_msg::samples_t m = block(0, 256, 100.0);
  m.first_index = INT64_MAX - 3;
  speed.take(m);
  m.first_index = -1;
  speed.take(m);
  m.first_index = 0;
  m.sample_time_ns = 0;
  speed.take(m);
  m.n = 0;
  speed.take(m);
  EXPECT_FALSE(speed.seen());
}

}  // namespace
}  // namespace imrig
