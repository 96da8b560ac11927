#include "rig/bridge/credit_keeper.h"

#include <gtest/gtest.h>

#include <imrig_msg/heartbeat_t.hpp>

namespace imrig {
namespace {

imrig_msg::ack_t ack(std::int32_t process, std::int64_t read_index, std::int64_t boot_id = 9) {
  imrig_msg::ack_t a = {};
  a.boot_id = boot_id;
  a.read_index = read_index;
  a.process = process;
  return a;
}

constexpr std::int32_t kRecorder = imrig_msg::heartbeat_t::RECORDER,
                       kEstimator = imrig_msg::heartbeat_t::ESTIMATOR;

TEST(CreditKeeper, WithoutFollowersTheBridgeReadsAlong) {
  CreditKeeper keeper(1000);
  keeper.new_boot(9, 0);
  EXPECT_EQ(keeper.horizon(0, 0), 1000);
  EXPECT_EQ(keeper.horizon(700, 0), 1700);
}

TEST(CreditKeeper, SlowestLiveFollowerSetsTheHorizon) {
  CreditKeeper keeper(1000);
  keeper.new_boot(9, 0);
  keeper.on_ack(ack(kRecorder, 500), 0);
  keeper.on_ack(ack(kEstimator, 200), 0);
  EXPECT_EQ(keeper.horizon(800, 10), 1200);
  keeper.on_ack(ack(kEstimator, 600), 20);
  EXPECT_EQ(keeper.horizon(800, 30), 1500);
}

TEST(CreditKeeper, TwoRecordersAreTwoFollowers) {
  CreditKeeper keeper(1000);
  keeper.new_boot(9, 0);
  imrig_msg::ack_t slow = ack(kRecorder, 100);
  slow.pid = 1;
  imrig_msg::ack_t fast = ack(kRecorder, 700);
  fast.pid = 2;
  keeper.on_ack(slow, 0);
  keeper.on_ack(fast, 1);
  EXPECT_EQ(keeper.horizon(800, 10), 1100);
}

TEST(CreditKeeper, HorizonNeverFalls) {
  CreditKeeper keeper(1000);
  keeper.new_boot(9, 0);
  EXPECT_EQ(keeper.horizon(5000, 0), 6000);
  keeper.on_ack(ack(kRecorder, 100), 1);
  EXPECT_EQ(keeper.horizon(5000, 2), 6000);
}

TEST(CreditKeeper, FollowerIsForgottenAfterASecond) {
  CreditKeeper keeper(1000);
  keeper.new_boot(9, 0);
  keeper.on_ack(ack(kRecorder, 100), 0);
  EXPECT_EQ(keeper.horizon(5000, 999'999), 1100);
  EXPECT_EQ(keeper.horizon(5000, 1'000'000), 6000);
}

TEST(CreditKeeper, FollowerCannotReadAheadOfTheBridge) {
  CreditKeeper keeper(1000);
  keeper.new_boot(9, 0);
  keeper.on_ack(ack(kRecorder, INT64_MAX - 10), 0);
  EXPECT_EQ(keeper.horizon(50, 1), 1050);
  keeper.on_ack(ack(kRecorder, INT64_MIN), 1);
  EXPECT_EQ(keeper.horizon(50, 2), 1050);
}

TEST(CreditKeeper, NewBootStartsOverAndOldAcksDoNotCount) {
  CreditKeeper keeper(1000);
  keeper.new_boot(9, 0);
  keeper.on_ack(ack(kRecorder, 90'000), 0);
  EXPECT_EQ(keeper.horizon(90'000, 1), 91'000);
  keeper.new_boot(10, 0);
  EXPECT_EQ(keeper.horizon(0, 2), 1000);
  keeper.on_ack(ack(kRecorder, 90'000, 9), 3);
  EXPECT_EQ(keeper.horizon(500, 4), 1000) << "who followed before is expected from the first sample on";
  keeper.on_ack(ack(kRecorder, 400, 10), 5);
  EXPECT_EQ(keeper.horizon(500, 6), 1400);
}

}  // namespace
}  // namespace imrig
