#include "rig/safety/lease_authority.h"

#include <gtest/gtest.h>

#include <string>

#include "tests/rig/safety/lease_fixture.h"

namespace imrig {
namespace {

using imrig_msg::lease_cmd_t;

enum class Held { kFree, kOurs, kTheirs };

LeaseAuthority authority_in(Held state) {
  LeaseAuthority authority(kBridge, kLease_us, counting_ids());
  const std::int64_t holder = state == Held::kOurs ? 7 : 8;
  if (state != Held::kFree)
    authority.request(lease_request(authority, lease_cmd_t::ACQUIRE, holder, 1, kStart), kStart);
  return authority;
}

TEST(LeaseAuthority, EveryRequestInEveryStateIsAnsweredAsTheTableSays) {
  // each row: request as client 7; taken when the lease is free, ours, theirs
  struct Row {
    std::string name;
    std::int32_t request;
    bool right_challenge, right_epoch;
    bool taken[3];
  };
  const Row rows[] = {
      {"acquire", lease_cmd_t::ACQUIRE, true, false, {true, false, false}},
      {"acquire with an old challenge", lease_cmd_t::ACQUIRE, false, false, {false, false, false}},
      {"renew", lease_cmd_t::RENEW, false, true, {false, true, false}},
      {"renew with an old epoch", lease_cmd_t::RENEW, true, false, {false, false, false}},
      {"release", lease_cmd_t::RELEASE, false, true, {false, true, false}},
      {"release with an old epoch", lease_cmd_t::RELEASE, true, false, {false, false, false}},
      {"unknown request", 17, true, true, {false, false, false}},
  };
  for (const Row& row : rows) {
    for (const Held state : {Held::kFree, Held::kOurs, Held::kTheirs}) {
      LeaseAuthority authority = authority_in(state);
      const imrig_msg::lease_t before = authority.status(kStart);
      lease_cmd_t cmd = lease_request(authority, row.request, 7, 2, kStart);
      if (!row.right_challenge) cmd.challenge += 12345;
      if (!row.right_epoch) cmd.epoch += 12345;
      const bool taken = authority.request(cmd, kStart);
      EXPECT_EQ(taken, row.taken[static_cast<int>(state)])
          << row.name << " in state " << static_cast<int>(state);
      const imrig_msg::lease_t after = authority.status(kStart);
      if (!taken) {
        EXPECT_EQ(after.epoch, before.epoch) << row.name;
        EXPECT_EQ(after.holder, before.holder) << row.name;
        EXPECT_EQ(after.challenge, before.challenge) << row.name;
      } else if (row.request != lease_cmd_t::RENEW) {
        EXPECT_NE(after.challenge, before.challenge) << row.name;
        EXPECT_NE(after.epoch, before.epoch) << row.name;
      }
    }
  }
}

TEST(LeaseAuthority, GrantNamesHolderEpochAndTimeLeft) {
  LeaseAuthority authority = authority_in(Held::kOurs);
  const imrig_msg::lease_t lease = authority.status(later(kStart, 500'000));
  EXPECT_EQ(lease.holder, 7);
  EXPECT_EQ(lease.epoch, authority.epoch());
  EXPECT_NE(lease.epoch, 0);
  EXPECT_EQ(lease.expires_in_ms, 1500);
}

TEST(LeaseAuthority, LeaseEndsWithoutRenewalAndSaysSoOnce) {
  LeaseAuthority authority = authority_in(Held::kOurs);
  EXPECT_EQ(authority.step(later(kStart, kLease_us - 1)), LeaseEnd::kNone);
  EXPECT_TRUE(authority.held());
  EXPECT_EQ(authority.step(later(kStart, kLease_us)), LeaseEnd::kExpired);
  EXPECT_FALSE(authority.held());
  EXPECT_EQ(authority.step(later(kStart, kLease_us + 1)), LeaseEnd::kNone);
}

TEST(LeaseAuthority, ExpiryThatARequestUncoversIsStillReported) {
  LeaseAuthority authority = authority_in(Held::kOurs);
  const Moment now = later(kStart, kLease_us + 5);
  EXPECT_FALSE(authority.request(lease_request(authority, lease_cmd_t::RENEW, 7, 2, now), now));
  EXPECT_FALSE(authority.held());
  EXPECT_EQ(authority.step(now), LeaseEnd::kExpired);
}

TEST(LeaseAuthority, RenewalProlongsByOneLeaseTime) {
  LeaseAuthority authority = authority_in(Held::kOurs);
  const Moment now = later(kStart, 1'500'000);
  EXPECT_TRUE(authority.request(lease_request(authority, lease_cmd_t::RENEW, 7, 2, now), now));
  EXPECT_EQ(authority.step(later(now, kLease_us - 1)), LeaseEnd::kNone);
  EXPECT_EQ(authority.step(later(now, kLease_us)), LeaseEnd::kExpired);
}

TEST(LeaseAuthority, RepeatedRenewalProlongsNothing) {
  LeaseAuthority authority = authority_in(Held::kOurs);
  const lease_cmd_t renewal = lease_request(authority, lease_cmd_t::RENEW, 7, 2, kStart);
  EXPECT_TRUE(authority.request(renewal, kStart));
  EXPECT_FALSE(authority.request(renewal, later(kStart, 100'000)));
  EXPECT_EQ(authority.step(later(kStart, kLease_us)), LeaseEnd::kExpired);
}

TEST(LeaseAuthority, ReleaseFreesTheLeaseAndIsReported) {
  LeaseAuthority authority = authority_in(Held::kOurs);
  EXPECT_TRUE(authority.request(lease_request(authority, lease_cmd_t::RELEASE, 7, 2, kStart), kStart));
  EXPECT_EQ(authority.step(kStart), LeaseEnd::kReleased);
  EXPECT_TRUE(authority.request(lease_request(authority, lease_cmd_t::ACQUIRE, 8, 1, kStart), kStart));
  EXPECT_EQ(authority.holder(), 8);
}

TEST(LeaseAuthority, AnotherAuthoritysRequestIsPassedOver) {
  LeaseAuthority authority(kBridge, kLease_us, counting_ids());
  lease_cmd_t cmd = lease_request(authority, lease_cmd_t::ACQUIRE, 7, 1, kStart);
  cmd.authority = imrig_msg::heartbeat_t::DYNO;
  EXPECT_FALSE(authority.request(cmd, kStart));
}

TEST(LeaseAuthority, HolderZeroIsNobody) {
  LeaseAuthority authority(kBridge, kLease_us, counting_ids());
  EXPECT_FALSE(authority.request(lease_request(authority, lease_cmd_t::ACQUIRE, 0, 1, kStart), kStart));
}

TEST(LeaseAuthority, WallClockJumpsNeitherGrantNorProlong) {
  for (const std::int64_t jump_us : {-3'600'000'000ll, 3'600'000'000ll}) {
    LeaseAuthority authority(kBridge, kLease_us, counting_ids());
    const Moment jumped = {kStart.steady_us, kStart.wall_us + jump_us};
    // issued before the jump, heard after it: as good as stale or from the future
    EXPECT_FALSE(authority.request(lease_request(authority, lease_cmd_t::ACQUIRE, 7, 1, kStart), jumped))
        << jump_us;
    EXPECT_TRUE(authority.request(lease_request(authority, lease_cmd_t::ACQUIRE, 7, 2, jumped), jumped));
    const Moment back = {kStart.steady_us + kLease_us, kStart.wall_us};
    EXPECT_EQ(authority.step(back), LeaseEnd::kExpired) << jump_us;
  }
}

TEST(LeaseAuthority, SteadyClockThatRunsBackwardsEndsTheLease) {
  LeaseAuthority authority = authority_in(Held::kOurs);
  EXPECT_EQ(authority.step({kStart.steady_us - 1, kStart.wall_us}), LeaseEnd::kExpired);
}

TEST(LeaseAuthority, AbsurdNumbersAreRefusedWithoutOverflow) {
  LeaseAuthority authority(kBridge, kLease_us, counting_ids());
  lease_cmd_t cmd = lease_request(authority, lease_cmd_t::ACQUIRE, 7, 1, kStart);
  for (const std::int64_t issued : {INT64_MIN, INT64_MAX, std::int64_t{-1}, std::int64_t{0}}) {
    cmd.issued_host_utime = issued;
    for (const std::int32_t ttl : {INT32_MIN, -1, 0, 1000}) {
      cmd.ttl_ms = ttl;
      EXPECT_FALSE(authority.request(cmd, kStart)) << issued << " " << ttl;
    }
  }
}

}  // namespace
}  // namespace imrig
