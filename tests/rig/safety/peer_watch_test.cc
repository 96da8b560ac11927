#include "rig/safety/peer_watch.h"

#include <gtest/gtest.h>

#include <string>

#include "tests/rig/safety/lease_fixture.h"

namespace imrig {
namespace {

using imrig_msg::heartbeat_t;

constexpr std::int64_t kSilence_us = 2'000'000;

heartbeat_t beat(std::int64_t seq, Moment now, std::int32_t state = heartbeat_t::OK,
                 std::int64_t instance = 55) {
  heartbeat_t h = {};
  h.heartbeat_v1 = 1;
  h.seq = seq;
  h.host_utime = now.wall_us;
  h.instance = instance;
  h.process = heartbeat_t::DYNO;
  h.state = state;
  return h;
}

// How the peer stands when the question is asked.
PeerWatch watch_with(const std::string& peer, Moment now) {
  PeerWatch watch(heartbeat_t::DYNO, kSilence_us);
  if (peer == "never seen") return watch;
  const Moment then = peer == "silent" ? later(now, -kSilence_us) : now;
  watch.on_heartbeat(beat(1, then), then);
  if (peer == "degraded") watch.on_heartbeat(beat(2, now, heartbeat_t::DEGRADED), now);
  if (peer == "tripped") watch.on_heartbeat(beat(2, now, heartbeat_t::TRIPPED), now);
  if (peer == "leaving") watch.on_heartbeat(beat(2, now, heartbeat_t::STOPPING), now);
  if (peer == "restarted") watch.on_heartbeat(beat(1, now, heartbeat_t::OK, 56), now);
  return watch;
}

TEST(PeerWatch, EveryStateOfThePeerIsJudgedAsTheTableSays) {
  struct Row {
    std::string peer;
    Trip active, required;
  };
  const Row rows[] = {
      {"never seen", Trip::kNone, Trip::kPeerSilent},
      {"alive", Trip::kNone, Trip::kNone},
      {"degraded", Trip::kNone, Trip::kNone},
      {"tripped", Trip::kPeerTripped, Trip::kPeerTripped},
      {"silent", Trip::kPeerSilent, Trip::kPeerSilent},
      {"leaving", Trip::kPeerSilent, Trip::kPeerSilent},
      {"restarted", Trip::kPeerSilent, Trip::kPeerSilent},
  };
  for (const Row& row : rows) {
    EXPECT_EQ(watch_with(row.peer, kStart).check(kStart, true, false), row.active) << row.peer;
    EXPECT_EQ(watch_with(row.peer, kStart).check(kStart, true, true), row.required) << row.peer;
    EXPECT_EQ(watch_with(row.peer, kStart).check(kStart, false, false), Trip::kNone) << row.peer;
    EXPECT_EQ(watch_with(row.peer, kStart).check(kStart, false, true), Trip::kNone) << row.peer;
  }
}

TEST(PeerWatch, PeerThatSaysGoodbyeWhileWeAreIdleIsForgotten) {
  PeerWatch watch = watch_with("leaving", kStart);
  watch.check(kStart, false);
  EXPECT_FALSE(watch.seen());
  EXPECT_EQ(watch.check(later(kStart, 60'000'000), true), Trip::kNone);
}

TEST(PeerWatch, RestartWhileWeAreIdleIsNoFault) {
  PeerWatch watch = watch_with("restarted", kStart);
  watch.check(kStart, false);
  EXPECT_EQ(watch.check(kStart, true), Trip::kNone);
}

TEST(PeerWatch, SilentPeerIsForgottenOnlyWhenAskedTo) {
  PeerWatch watch = watch_with("silent", kStart);
  watch.check(kStart, false);
  EXPECT_EQ(watch.check(kStart, true), Trip::kPeerSilent);
  watch.forget_if_silent(kStart);
  EXPECT_EQ(watch.check(kStart, true), Trip::kNone);
  PeerWatch alive = watch_with("alive", kStart);
  alive.forget_if_silent(kStart);
  EXPECT_TRUE(alive.seen());
}

TEST(PeerWatch, ReplayedHeartbeatsAreNoSignOfLife) {
  PeerWatch watch(heartbeat_t::DYNO, kSilence_us);
  watch.on_heartbeat(beat(1, later(kStart, -3'600'000'000)), kStart);
  EXPECT_FALSE(watch.seen());
  const heartbeat_t last = beat(1, kStart);
  watch.on_heartbeat(last, kStart);
  ASSERT_TRUE(watch.seen());
  for (int k = 0; k < 10; ++k) watch.on_heartbeat(last, later(kStart, 199'000 * k));
  EXPECT_EQ(watch.check(later(kStart, kSilence_us), true), Trip::kPeerSilent);
}

TEST(PeerWatch, WallClockJumpsFailClosed) {
  for (const std::int64_t jump_us : {-3'600'000'000ll, 3'600'000'000ll}) {
    PeerWatch watch = watch_with("alive", kStart);
    // our clock jumps, the peer's (on another machine) does not: its heartbeats cannot be dated any more
    for (int k = 1; k <= 10; ++k) {
      const Moment theirs = later(kStart, 200'000 * k);
      watch.on_heartbeat(beat(1 + k, theirs), {theirs.steady_us, theirs.wall_us + jump_us});
    }
    const Moment now = later(kStart, kSilence_us);
    EXPECT_EQ(watch.check({now.steady_us, now.wall_us + jump_us}, true), Trip::kPeerSilent) << jump_us;
  }
}

TEST(PeerWatch, OtherProcessesAreNotThePeer) {
  PeerWatch watch(heartbeat_t::DYNO, kSilence_us);
  heartbeat_t recorder = beat(1, kStart);
  recorder.process = heartbeat_t::RECORDER;
  watch.on_heartbeat(recorder, kStart);
  EXPECT_FALSE(watch.seen());
}

}  // namespace
}  // namespace imrig
