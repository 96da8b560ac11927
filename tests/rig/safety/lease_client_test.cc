#include "rig/safety/lease_client.h"

#include <gtest/gtest.h>

#include <imrig_msg/bridge_cmd_t.hpp>

#include "rig/safety/command_guard.h"
#include "tests/rig/safety/lease_fixture.h"

namespace imrig {
namespace {

using imrig_msg::lease_cmd_t;

// Client and authority on a perfect bus, stepped every 20 ms; the authority speaks every 100 ms and at
// changes, as the bridge does.
struct Pair {
  Moment now = kStart;
  LeaseAuthority authority{kBridge, kLease_us, counting_ids()};
  LeaseClient client{kBridge, 7, kLease_us};
  bool wire = true;
  int requests = 0;
  LeaseEnd ended = LeaseEnd::kNone;
  std::int64_t spoke_us = 0;

  void speak() {
    spoke_us = now.steady_us;
    if (wire) client.on_lease(authority.status(now), now);
  }
  void run(std::int64_t for_us) {
    for (const std::int64_t until = now.steady_us + for_us; now.steady_us < until; now = later(now, 20'000)) {
      if (const LeaseEnd end = authority.step(now); end != LeaseEnd::kNone) ended = end;
      if (now.steady_us - spoke_us >= 100'000) speak();
      const auto cmd = client.step(now);
      if (!cmd) continue;
      ++requests;
      if (wire && authority.request(*cmd, now)) speak();
    }
  }
};

TEST(LeaseClient, AcquiresAndKeepsTheLeaseForAsLongAsItRenews) {
  Pair pair;
  pair.client.acquire();
  pair.run(200'000);
  ASSERT_TRUE(pair.client.held());
  EXPECT_EQ(pair.client.epoch(), pair.authority.epoch());
  const int before = pair.requests;
  pair.run(20'000'000);
  EXPECT_TRUE(pair.client.held());
  EXPECT_EQ(pair.ended, LeaseEnd::kNone);
  EXPECT_NEAR(pair.requests - before, 30, 3);  // one every third of two seconds
}

TEST(LeaseClient, ReleaseEndsTheLeaseAndIsNoLoss) {
  Pair pair;
  pair.client.acquire();
  pair.run(200'000);
  pair.client.release();
  pair.run(200'000);
  EXPECT_FALSE(pair.authority.held());
  EXPECT_EQ(pair.ended, LeaseEnd::kReleased);
  EXPECT_FALSE(pair.client.held());
  EXPECT_FALSE(pair.client.lost());
  pair.run(1'000'000);
  EXPECT_FALSE(pair.authority.held()) << "a released lease must not come back by itself";
}

TEST(LeaseClient, CanAcquireAgainAfterARelease) {
  Pair pair;
  pair.client.acquire();
  pair.run(200'000);
  pair.client.release();
  pair.client.acquire();
  pair.run(400'000);
  EXPECT_TRUE(pair.client.held());
  EXPECT_TRUE(pair.authority.held());
}

TEST(LeaseClient, KnowsThatItLostTheLeaseWhenTheBusGoesDead) {
  Pair pair;
  pair.client.acquire();
  pair.run(200'000);
  pair.wire = false;
  pair.run(kLease_us);
  EXPECT_FALSE(pair.client.held());
  EXPECT_TRUE(pair.client.lost());
  EXPECT_EQ(pair.ended, LeaseEnd::kExpired);
  pair.wire = true;
  pair.run(2'000'000);
  EXPECT_FALSE(pair.client.held()) << "lost stays lost until somebody decides to acquire again";
  pair.client.acquire();
  EXPECT_FALSE(pair.client.lost());
  pair.run(200'000);
  EXPECT_TRUE(pair.client.held());
}

TEST(LeaseClient, ClientNeverBelievesLongerThanTheAuthority) {
  Pair pair;
  pair.client.acquire();
  pair.run(200'000);
  pair.wire = false;
  while (pair.client.held()) {
    ASSERT_TRUE(pair.authority.held()) << "authority ended first";
    pair.now = later(pair.now, 1000);
    pair.client.step(pair.now);
    pair.authority.step(pair.now);
  }
  EXPECT_FALSE(pair.client.held());
}

TEST(LeaseClient, WaitsWhileSomebodyElseHoldsTheLease) {
  Pair pair;
  pair.authority.request(lease_request(pair.authority, lease_cmd_t::ACQUIRE, 8, 1, pair.now), pair.now);
  pair.client.acquire();
  pair.run(1'000'000);
  EXPECT_FALSE(pair.client.held());
  EXPECT_EQ(pair.client.other_holder(), 8);
  EXPECT_EQ(pair.requests, 0);
  pair.run(2'000'000);  // theirs expires
  EXPECT_TRUE(pair.client.held());
  EXPECT_EQ(pair.client.other_holder(), 0);
}

TEST(LeaseClient, LosesTheLeaseWhenTheAuthorityRestarts) {
  Pair pair;
  pair.client.acquire();
  pair.run(200'000);
  pair.authority = LeaseAuthority(kBridge, kLease_us, counting_ids(5000));
  pair.run(200'000);
  EXPECT_TRUE(pair.client.lost());
}

TEST(LeaseClient, GivesBackAGrantThatCameAfterItChangedItsMind) {
  Pair pair;
  pair.client.acquire();
  pair.speak();
  const auto request = pair.client.step(pair.now);
  ASSERT_TRUE(request.has_value());
  pair.client.release();
  pair.authority.request(*request, pair.now);
  ASSERT_TRUE(pair.authority.held());
  pair.run(200'000);
  EXPECT_FALSE(pair.authority.held());
  EXPECT_FALSE(pair.client.held());
}

TEST(LeaseClient, SignedCommandsPassTheGuardAndRiseInSequence) {
  Pair pair;
  pair.client.acquire();
  pair.run(200'000);
  CommandGuard guard;
  imrig_msg::bridge_cmd_t cmd = {};
  for (int k = 0; k < 3; ++k) {
    pair.client.sign(cmd, pair.now);
    EXPECT_EQ(guard.check(stamp_of(cmd), pair.authority.epoch(), pair.now), CommandResult::kDone);
    EXPECT_EQ(guard.check(stamp_of(cmd), pair.authority.epoch(), pair.now), CommandResult::kNotNew);
  }
}

}  // namespace
}  // namespace imrig
