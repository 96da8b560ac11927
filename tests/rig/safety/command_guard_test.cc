#include "rig/safety/command_guard.h"

#include <gtest/gtest.h>

#include "tests/rig/safety/lease_fixture.h"

namespace imrig {
namespace {

constexpr std::int64_t kEpoch = 4711;

CommandStamp stamp(std::int64_t seq, Moment issued = kStart, std::int32_t ttl_ms = 1000) {
  return {kEpoch, seq, issued.wall_us, ttl_ms};
}

TEST(CommandGuard, TakesACommandOfTheHolderOnce) {
  CommandGuard guard;
  EXPECT_EQ(guard.check(stamp(1), kEpoch, kStart), CommandResult::kDone);
  EXPECT_EQ(guard.check(stamp(1), kEpoch, kStart), CommandResult::kNotNew);
}

TEST(CommandGuard, SequenceMayJumpButNeverFall) {
  CommandGuard guard;
  EXPECT_EQ(guard.check(stamp(5), kEpoch, kStart), CommandResult::kDone);
  EXPECT_EQ(guard.check(stamp(4), kEpoch, kStart), CommandResult::kNotNew);
  EXPECT_EQ(guard.check(stamp(900), kEpoch, kStart), CommandResult::kDone);
}

TEST(CommandGuard, OtherEpochsAreNotTheHolders) {
  CommandGuard guard;
  EXPECT_EQ(guard.check(stamp(1), kEpoch + 1, kStart), CommandResult::kNoLease);
  EXPECT_EQ(guard.check(stamp(1), 0, kStart), CommandResult::kNoLease);
  CommandStamp nobody = stamp(1);
  nobody.epoch = 0;
  EXPECT_EQ(guard.check(nobody, 0, kStart), CommandResult::kNoLease);
}

TEST(CommandGuard, RefusedEpochsUseNoSequenceUp) {
  CommandGuard guard;
  CommandStamp alien = stamp(1000);
  alien.epoch = 1;
  EXPECT_EQ(guard.check(alien, kEpoch, kStart), CommandResult::kNoLease);
  EXPECT_EQ(guard.check(stamp(1), kEpoch, kStart), CommandResult::kDone);
}

TEST(CommandGuard, NewEpochStartsTheSequenceAnew) {
  CommandGuard guard;
  EXPECT_EQ(guard.check(stamp(50), kEpoch, kStart), CommandResult::kDone);
  CommandStamp next = stamp(1);
  next.epoch = kEpoch + 1;
  EXPECT_EQ(guard.check(next, kEpoch + 1, kStart), CommandResult::kDone);
}

TEST(CommandGuard, LateCommandIsStaleAndItsSequenceIsUsedUp) {
  CommandGuard guard;
  EXPECT_EQ(guard.check(stamp(1), kEpoch, later(kStart, 1'000'000)), CommandResult::kStale);
  EXPECT_EQ(guard.check(stamp(1), kEpoch, kStart), CommandResult::kNotNew);
  EXPECT_EQ(guard.check(stamp(2), kEpoch, later(kStart, 999'999)), CommandResult::kDone);
}

TEST(CommandGuard, CommandFromTheFutureIsRefused) {
  CommandGuard guard;
  EXPECT_EQ(guard.check(stamp(1, later(kStart, 1'000'001)), kEpoch, kStart), CommandResult::kStale);
  EXPECT_EQ(guard.check(stamp(2, later(kStart, 1'000'000)), kEpoch, kStart), CommandResult::kDone);
}

TEST(CommandGuard, WallClockJumpsFailClosed) {
  CommandGuard guard;
  const Moment back = {kStart.steady_us, kStart.wall_us - 3'600'000'000};
  const Moment ahead = {kStart.steady_us, kStart.wall_us + 3'600'000'000};
  EXPECT_EQ(guard.check(stamp(1), kEpoch, back), CommandResult::kStale);
  EXPECT_EQ(guard.check(stamp(2), kEpoch, ahead), CommandResult::kStale);
}

TEST(CommandGuard, TimeToLiveAndSequenceMustMakeSense) {
  CommandGuard guard;
  for (const std::int32_t ttl : {0, -1, INT32_MIN, kLongestTtl_ms + 1, INT32_MAX}) {
    EXPECT_EQ(guard.check(stamp(1, kStart, ttl), kEpoch, kStart), CommandResult::kMalformed) << ttl;
  }
  for (const std::int64_t seq : {std::int64_t{0}, std::int64_t{-1}, INT64_MIN}) {
    EXPECT_EQ(guard.check(stamp(seq), kEpoch, kStart), CommandResult::kMalformed) << seq;
  }
  EXPECT_EQ(guard.check(stamp(1), kEpoch, kStart), CommandResult::kDone);
}

TEST(CommandGuard, AbsurdDatesAreStaleWithoutOverflow) {
  CommandGuard guard;
  std::int64_t seq = 0;
  for (const std::int64_t issued : {INT64_MIN, INT64_MAX, std::int64_t{-1}, std::int64_t{0}}) {
    EXPECT_EQ(guard.check({kEpoch, ++seq, issued, 1000}, kEpoch, kStart), CommandResult::kStale) << issued;
  }
}

}  // namespace
}  // namespace imrig
