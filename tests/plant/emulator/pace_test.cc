#include "plant/emulator/pace.h"

#include <gtest/gtest.h>

#include "rig/base/error.h"

namespace imrig::plant {
namespace {

TEST(Pace, IsRealtimeMaxOrANumber) {
  EXPECT_FALSE(parse_pace("realtime").waits_for_credit());
  EXPECT_TRUE(parse_pace("max").waits_for_credit());
  EXPECT_TRUE(parse_pace("2.5").waits_for_credit());
  EXPECT_EQ(parse_pace("2.5").times, 2.5);
  for (const char* word : {"", "fast", "0", "-1", "1x", "nan", "inf", "20000", "MAX"}) {
    EXPECT_THROW(parse_pace(word), Error) << word;
  }
}

TEST(PaceClock, InRealTimeTakesOneSampleEverySampleTimeForever) {
  PaceClock clock(parse_pace("realtime"), 60000);
  clock.start(1000, 7);
  EXPECT_EQ(clock.due(1000, 7, 256), 1);
  EXPECT_EQ(clock.due(1000, 8, 256), 0);
  EXPECT_EQ(clock.due(1059, 8, 256), 0);
  EXPECT_EQ(clock.due(1060, 8, 256), 1);
  EXPECT_EQ(clock.due_us(8), 1060);
  const std::int64_t day_us = 86400000000;
  EXPECT_EQ(clock.due_us(7 + day_us / 60), 1000 + day_us);
  EXPECT_EQ(clock.due(1000 + day_us, 7 + day_us / 60, 256), 1);
}

TEST(PaceClock, InRealTimeCatchesUpAndNeverForgives) {
  PaceClock clock(parse_pace("realtime"), 60000);
  clock.start(0, 0);
  EXPECT_EQ(clock.due(60 * 1000, 0, 256), 256);
  clock.waited(60 * 1000, 0);
  EXPECT_EQ(clock.due(60 * 1000, 256, 10000), 745);
}

TEST(PaceClock, AtPaceNForgivesTheTimeItWaitedForCredit) {
  PaceClock clock(parse_pace("4"), 60000);
  clock.start(0, 0);
  EXPECT_EQ(clock.due(150, 0, 256), 11);
  clock.waited(1000000, 11);
  EXPECT_EQ(clock.due(1000000, 11, 256), 1);
  EXPECT_EQ(clock.due(1000015, 11, 256), 2);
}

TEST(PaceClock, AtMaxIsAlwaysDue) {
  PaceClock clock(parse_pace("max"), 60000);
  clock.start(0, 0);
  EXPECT_EQ(clock.due(0, 1000000, 256), 256);
  EXPECT_LE(clock.due_us(1000000), 0);
}

}  // namespace
}  // namespace imrig::plant
