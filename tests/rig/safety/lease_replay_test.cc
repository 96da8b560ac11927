// A log of a whole session - lease requests and commands as the clients sent them - played back onto the same
// or a new authority, whole or in any order, at once or later: nothing moves.

#include <gtest/gtest.h>

#include <algorithm>
#include <imrig_msg/bridge_cmd_t.hpp>
#include <random>
#include <vector>

#include "rig/safety/command_guard.h"
#include "tests/rig/safety/lease_fixture.h"

namespace imrig {
namespace {

using imrig_msg::bridge_cmd_t;
using imrig_msg::lease_cmd_t;

struct Session {
  LeaseAuthority authority{kBridge, kLease_us, counting_ids()};
  CommandGuard guard;
  std::vector<lease_cmd_t> requests;
  std::vector<bridge_cmd_t> commands;
  Moment now = kStart;
};

// Three clients, one after the other: acquire, five commands, renewals, release.
Session recorded_session() {
  Session s;
  for (std::int64_t holder = 7; holder < 10; ++holder) {
    LeaseClient client(kBridge, holder, kLease_us);
    client.acquire();
    client.on_lease(s.authority.status(s.now), s.now);
    for (int k = 0; k < 200; ++k, s.now = later(s.now, 20'000)) {
      if (k == 190) client.release();
      if (const auto cmd = client.step(s.now)) {
        s.requests.push_back(*cmd);
        EXPECT_TRUE(s.authority.request(*cmd, s.now));
        client.on_lease(s.authority.status(s.now), s.now);
      }
      if (k % 40 != 20) continue;
      client.on_lease(s.authority.status(s.now), s.now);
      bridge_cmd_t cmd = {};
      client.sign(cmd, s.now);
      s.commands.push_back(cmd);
      EXPECT_EQ(s.guard.check(stamp_of(cmd), s.authority.epoch(), s.now), CommandResult::kDone);
    }
  }
  return s;
}

// The age of the log must not matter: each message is dated as if it had just been sent, which a forger could
// do and a player cannot.
void expect_nothing_moves(Session& s, LeaseAuthority& authority, CommandGuard& guard, bool redated) {
  const std::int64_t epoch = authority.epoch();
  const std::int64_t holder = authority.holder();
  for (lease_cmd_t cmd : s.requests) {
    if (redated) cmd.issued_host_utime = s.now.wall_us;
    EXPECT_FALSE(authority.request(cmd, s.now));
    EXPECT_EQ(authority.epoch(), epoch);
    EXPECT_EQ(authority.holder(), holder);
  }
  for (bridge_cmd_t cmd : s.commands) {
    if (redated) cmd.issued_host_utime = s.now.wall_us;
    EXPECT_NE(guard.check(stamp_of(cmd), authority.epoch(), s.now), CommandResult::kDone);
  }
}

TEST(LeaseReplay, LogPlayedToTheSameBridgeMovesNothing) {
  Session s = recorded_session();
  ASSERT_GT(s.requests.size(), 9u);
  ASSERT_EQ(s.commands.size(), 15u);
  expect_nothing_moves(s, s.authority, s.guard, false);
  expect_nothing_moves(s, s.authority, s.guard, true);
}

TEST(LeaseReplay, LogPlayedToARestartedBridgeMovesNothing) {
  Session s = recorded_session();
  LeaseAuthority fresh(kBridge, kLease_us, counting_ids(900'000));
  CommandGuard guard;
  expect_nothing_moves(s, fresh, guard, true);
}

TEST(LeaseReplay, LogPlayedWhileSomebodyWorksMovesNothing) {
  Session s = recorded_session();
  ASSERT_TRUE(s.authority.request(lease_request(s.authority, lease_cmd_t::ACQUIRE, 99, 1, s.now), s.now));
  expect_nothing_moves(s, s.authority, s.guard, true);
  EXPECT_EQ(s.authority.holder(), 99);
}

TEST(LeaseReplay, ShuffledLogMovesNothing) {
  Session s = recorded_session();
  std::mt19937_64 random(77);
  for (int round = 0; round < 20; ++round) {
    std::shuffle(s.requests.begin(), s.requests.end(), random);
    std::shuffle(s.commands.begin(), s.commands.end(), random);
    expect_nothing_moves(s, s.authority, s.guard, true);
  }
}

}  // namespace
}  // namespace imrig
