#include "rig/campaign/sample_watch.h"

#include <gtest/gtest.h>

namespace imrig {
namespace {

imrig_msg::samples_t block(std::int64_t seq, std::int64_t first, int n, std::int32_t record = 0,
                           std::int32_t profile = 0) {
  imrig_msg::samples_t s = {};
  s.boot_id = 5;
  s.seq = seq;
  s.first_index = first;
  s.sample_time_ns = 60000;
  s.record = record;
  s.profile_id = profile;
  s.n = n;
  s.encoder.assign(static_cast<std::size_t>(n), 0);
  return s;
}

TEST(SampleWatch, CountsARecordAndSeesAHoleInIt) {
  SampleWatch watch;
  watch.expect_record(3);
  watch.on(block(0, 0, 100), 0);
  watch.on(block(1, 100, 50, 3), 0);
  watch.on(block(2, 150, 50, 3), 0);
  EXPECT_EQ(watch.record_samples(), 100);
  EXPECT_TRUE(watch.record_unbroken());
  watch.on(block(4, 210, 10, 3), 0);
  EXPECT_FALSE(watch.record_unbroken());
  EXPECT_EQ(watch.lost_blocks(), 1);
}

TEST(SampleWatch, NoticesWhereAProfileBeginsAndAReboot) {
  SampleWatch watch;
  watch.expect_profile(9);
  watch.on(block(0, 0, 100), 0);
  EXPECT_EQ(watch.profile_start(), -1);
  watch.on(block(1, 100, 20, 0, 9), 0);
  EXPECT_EQ(watch.profile_start(), 100);
  EXPECT_FALSE(watch.rebooted());
  auto other = block(0, 0, 10);
  other.boot_id = 6;
  watch.on(other, 0);
  EXPECT_TRUE(watch.rebooted());
}

TEST(SampleWatch, ShaftRestsOnceItHasStoodStillWithGatesOff) {
  SampleWatch watch;
  std::int64_t first = 0;
  const auto pass = [&](int count, std::int32_t speed, bool gates) {
    for (int k = 0; k < count; ++k) {
      auto s = block(first / 100, first, 100);
      s.gates_on = gates ? 1 : 0;
      for (int j = 0; j < 100; ++j)
        s.encoder[static_cast<std::size_t>(j)] =
            2147483600 + static_cast<std::int32_t>(speed > 0 ? (first + j) / speed : 0) % 40;
      watch.on(s, 0);
      first += 100;
    }
  };
  pass(60, 100, false);  // creeps: a count every 6 ms
  EXPECT_FALSE(watch.at_rest());
  pass(40, 0, false);
  EXPECT_FALSE(watch.at_rest());  // 0.24 s
  pass(20, 0, false);
  EXPECT_TRUE(watch.at_rest());
  pass(1, 0, true);
  EXPECT_FALSE(watch.at_rest());
}

TEST(SampleWatch, AcknowledgesOftenEnoughForTheSmallestWindow) {
  SampleWatch watch;
  EXPECT_FALSE(watch.acknowledge(0));
  watch.on(block(0, 0, 256), 0);
  EXPECT_EQ(watch.acknowledge(1'000'000), 256);
  EXPECT_FALSE(watch.acknowledge(1'000'001));
  for (int k = 1; k <= 4; ++k) watch.on(block(k, 256 * k, 256), 0);
  EXPECT_EQ(watch.acknowledge(1'000'002), 1280);
  watch.on(block(5, 1280, 1), 0);
  EXPECT_FALSE(watch.acknowledge(1'000'003));
  EXPECT_EQ(watch.acknowledge(1'030'000), 1281) << "few samples, but 20 ms later";
  EXPECT_EQ(watch.acknowledge(1'300'000), 1281) << "a sign of life while nothing comes";
}

}  // namespace
}  // namespace imrig
