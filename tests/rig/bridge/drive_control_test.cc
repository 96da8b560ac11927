// The drive against a scripted device: answers that come late, twice or never, and a device that does what it
// was not told to.

#include "rig/bridge/drive_control.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "rig/link/device/codec.h"
#include "rig/link/device/result.h"
#include "rig/link/frame_writer.h"

namespace imrig {
namespace {

struct Script {
  std::int64_t now_us = 1'000'000;
  LinkHost host;
  DriveControl drive;
  std::vector<imrig_order> orders;  // every order frame that left, repeats included
  std::int64_t device_seq = 100, device_us = 0;

  Script() : host(config()), drive(host) {
    welcome(7);
    status(IMRIG_IDLE);
  }

  static LinkHostConfig config() {
    LinkHostConfig c;
    c.host_nonce = 5;
    c.current_limit_A = c.speed_limit_rpm = c.stator_limit_C = c.voltage_limit_V = 100.0;
    return c;
  }

  template <class Encode, class Message>
  void hear(Encode encode, const Message& message) {
    host.receive(frame_of(encode, message), now_us);
    turn();
  }

  void turn() {
    host.poll(now_us);
    while (const auto event = host.next_event()) {
      if (const auto* e = std::get_if<LinkWelcome>(&*event)) drive.on_welcome(*e);
      if (const auto* e = std::get_if<LinkStatus>(&*event)) drive.on_status(e->message);
      if (const auto* e = std::get_if<LinkAnswer>(&*event)) drive.on_answer(*e);
      if (std::holds_alternative<LinkDown>(*event)) drive.on_down();
    }
    drive.poll(now_us);
    host.poll(now_us);
    std::vector<std::uint8_t> packet;
    FrameReader reader;
    while (host.next_output(packet)) {
      reader.feed(packet, [&](std::span<const std::uint8_t> payload) {
        imrig_order order;
        if (imrig_decode_order(payload.data(), payload.size(), &order) != 0) orders.push_back(order);
      });
    }
  }

  void wait_ms(int ms) {
    for (int k = 0; k < ms; ++k) {
      now_us += 1000;
      device_us += 1000;
      turn();
    }
  }

  void welcome(std::int64_t boot_id) {
    imrig_welcome m = {};
    m.welcome_v1 = 1;
    m.seq = ++device_seq;
    m.host_nonce = 5;
    m.boot_id = boot_id;
    m.sample_time_ns = 60'000;
    hear(imrig_encode_welcome, m);
  }

  void status(std::int32_t state, std::int32_t profile_id = 0, std::int64_t seq = 0, std::int32_t trip = 0) {
    imrig_status m = {};
    m.device_status_v1 = 1;
    m.seq = seq != 0 ? seq : ++device_seq;
    m.utime = device_us;
    m.boot_id = host.welcome()->boot_id;
    m.state = state;
    m.trip = trip;
    m.profile_id = profile_id;
    hear(imrig_encode_status, m);
  }

  // Status after status, as a device that goes on living says.
  void live_ms(int ms, std::int32_t state, std::int32_t profile_id = 0) {
    for (int k = 0; k < ms; k += 10) {
      wait_ms(10);
      status(state, profile_id);
    }
  }

  void answer(const imrig_order& order, std::int32_t result = IMRIG_DONE) {
    imrig_reply m = {};
    m.reply_v1 = 1;
    m.seq = ++device_seq;
    m.of_seq = order.seq;
    m.result = result;
    hear(imrig_encode_reply, m);
  }

  const imrig_order& last(std::int32_t action) {
    const auto found =
        std::find_if(orders.rbegin(), orders.rend(), [&](const auto& o) { return o.action == action; });
    EXPECT_NE(found, orders.rend()) << "no order " << action;
    return *found;
  }
  std::size_t count(std::int32_t action) const {
    return static_cast<std::size_t>(
        std::count_if(orders.begin(), orders.end(), [&](const auto& o) { return o.action == action; }));
  }

  void run_profile(std::int32_t id) {
    ASSERT_NE(drive.start(id), 0);
    turn();
    answer(last(IMRIG_START));
    live_ms(50, IMRIG_RUNNING, id);
    ASSERT_EQ(drive.state(), StopState::kRunning);
  }
};

TEST(DriveControl, DeviceThatDrivesUnorderedIsToldToOpenItsGates) {
  for (const std::int32_t state : {IMRIG_RUNNING, IMRIG_HOLDING, IMRIG_STOPPING}) {
    Script s;
    s.status(state, 3);
    EXPECT_EQ(s.drive.cause(), Trip::kLeaseLost) << state;
    EXPECT_EQ(s.count(IMRIG_TRIP), 1u) << state;
  }
}

TEST(DriveControl, StatusThatWasOnItsWayDoesNotEndAStart) {
  Script s;
  ASSERT_NE(s.drive.start(3), 0);
  s.turn();
  s.status(IMRIG_IDLE);
  EXPECT_EQ(s.drive.state(), StopState::kRunning) << "not answered yet";
  s.answer(s.last(IMRIG_START));
  s.status(IMRIG_IDLE);
  EXPECT_EQ(s.drive.state(), StopState::kRunning) << "answered, begins with the next PWM cycle";
  s.live_ms(50, IMRIG_RUNNING, 3);
  s.status(IMRIG_IDLE);
  EXPECT_EQ(s.drive.state(), StopState::kIdle) << "seen running, so this is the end";
}

TEST(DriveControl, HoldOfTheProfileBeforeIsNotTheHoldOfThisOne) {
  Script s;
  s.run_profile(3);
  s.status(IMRIG_HOLDING, 3);
  ASSERT_EQ(s.drive.state(), StopState::kHolding);
  ASSERT_NE(s.drive.start(4), 0);
  s.turn();
  s.answer(s.last(IMRIG_START));
  s.live_ms(200, IMRIG_HOLDING, 3);
  EXPECT_EQ(s.drive.state(), StopState::kRunning);
  s.status(IMRIG_HOLDING, 4);
  EXPECT_EQ(s.drive.state(), StopState::kHolding);
}

TEST(DriveControl, OvertakenStatusIsPassedOver) {
  Script s;
  s.run_profile(3);
  s.status(IMRIG_TRIPPED, 0, 50, 2);  // sequence from before the welcome
  EXPECT_EQ(s.drive.state(), StopState::kRunning);
}

TEST(DriveControl, RefusedStartReturnsToWhereItCameFrom) {
  Script idle;
  ASSERT_NE(idle.drive.start(3), 0);
  idle.turn();
  idle.answer(idle.last(IMRIG_START), IMRIG_NO_PROFILE);
  EXPECT_EQ(idle.drive.state(), StopState::kIdle);

  Script holding;
  holding.run_profile(3);
  holding.status(IMRIG_HOLDING, 3);
  ASSERT_NE(holding.drive.start(4), 0);
  holding.turn();
  holding.answer(holding.last(IMRIG_START), IMRIG_OVER_LIMIT);
  EXPECT_EQ(holding.drive.state(), StopState::kHolding);
  EXPECT_EQ(holding.drive.profile_id(), 3);
}

TEST(DriveControl, StartThatIsNeverAnsweredTrips) {
  Script s;
  ASSERT_NE(s.drive.start(3), 0);
  s.live_ms(3000, IMRIG_IDLE);
  EXPECT_EQ(s.drive.cause(), Trip::kLinkSilent) << "nobody knows whether it runs";
  EXPECT_GE(s.count(IMRIG_TRIP), 1u);
}

TEST(DriveControl, StopThatIsRefusedTrips) {
  Script s;
  s.run_profile(3);
  ASSERT_NE(s.drive.stop(), 0);
  s.turn();
  s.answer(s.last(IMRIG_STOP), IMRIG_MALFORMED);
  EXPECT_EQ(s.drive.state(), StopState::kTripped);
}

TEST(DriveControl, StopThatDoesNotEndTrips) {
  Script s;
  s.run_profile(3);
  ASSERT_NE(s.drive.stop(), 0);
  s.turn();
  s.answer(s.last(IMRIG_STOP));
  s.live_ms(9'900, IMRIG_STOPPING, 3);
  EXPECT_EQ(s.drive.state(), StopState::kStopping);
  s.live_ms(200, IMRIG_STOPPING, 3);
  EXPECT_EQ(s.drive.cause(), Trip::kStopTooLong);
}

TEST(DriveControl, RebootWithoutASilenceTrips) {
  Script s;
  s.run_profile(3);
  s.welcome(8);
  EXPECT_EQ(s.drive.cause(), Trip::kDeviceRebooted);
}

TEST(DriveControl, TripsOfTheDeviceKeepTheirCause) {
  Script s;
  s.run_profile(3);
  s.status(IMRIG_TRIPPED, 0, 0, IMRIG_TRIP_OVER_SPEED);
  EXPECT_EQ(s.drive.cause(), Trip::kDeviceOverSpeed);
}

TEST(DriveControl, GatesAreOrderedOpenAgainWhileTheDeviceSaysItDrives) {
  Script s;
  s.run_profile(3);
  s.drive.trip(Trip::kOperatorStop);
  s.turn();
  for (int k = 0; k < 5; ++k) {
    const auto before = s.last(IMRIG_TRIP).seq;
    s.answer(s.last(IMRIG_TRIP));  // it says done
    s.wait_ms(5);
    s.status(IMRIG_RUNNING, 3);  // and drives
    EXPECT_FALSE(s.drive.gates_known_off());
    EXPECT_GT(s.last(IMRIG_TRIP).seq, before) << "a new order, not a repeat that it has answered already";
  }
  s.answer(s.last(IMRIG_TRIP));
  s.status(IMRIG_TRIPPED, 0, 0, IMRIG_TRIP_ORDERED);
  EXPECT_TRUE(s.drive.gates_known_off());
  const std::size_t orders = s.orders.size();
  s.live_ms(500, IMRIG_TRIPPED);
  EXPECT_EQ(s.orders.size(), orders) << "then it is left in peace";
}

TEST(DriveControl, ClearThatTheDeviceRefusesLeavesItTripped) {
  Script s;
  s.drive.trip(Trip::kOperatorStop);
  s.turn();
  s.answer(s.last(IMRIG_TRIP));
  s.status(IMRIG_TRIPPED, 0, 0, IMRIG_TRIP_ORDERED);
  ASSERT_NE(s.drive.clear(), 0);
  s.turn();
  s.answer(s.last(IMRIG_CLEAR), IMRIG_BUSY);
  EXPECT_EQ(s.drive.state(), StopState::kTripped);
  EXPECT_EQ(s.drive.cause(), Trip::kOperatorStop);
}

TEST(DriveControl, TripDuringAResetWins) {
  Script s;
  s.drive.trip(Trip::kOperatorStop);
  s.turn();
  s.answer(s.last(IMRIG_TRIP));
  s.status(IMRIG_TRIPPED, 0, 0, IMRIG_TRIP_ORDERED);
  ASSERT_NE(s.drive.clear(), 0);
  s.turn();
  const imrig_order clear = s.last(IMRIG_CLEAR);
  const std::int64_t before = s.last(IMRIG_TRIP).seq;
  s.drive.trip(Trip::kOverSpeed);
  s.turn();
  EXPECT_GT(s.last(IMRIG_TRIP).seq, before);
  s.answer(clear);
  EXPECT_EQ(s.drive.state(), StopState::kTripped);
  EXPECT_EQ(s.drive.cause(), Trip::kOperatorStop);
}

TEST(DriveControl, LateAnswerToAnOldTripSaysNothingAboutTheNextOne) {
  Script s;
  s.drive.trip(Trip::kOperatorStop);
  s.turn();
  const imrig_order old = s.last(IMRIG_TRIP);  // carried out, its answer is lost
  s.status(IMRIG_TRIPPED, 0, 0, IMRIG_TRIP_ORDERED);
  ASSERT_NE(s.drive.clear(), 0);
  s.turn();
  s.answer(s.last(IMRIG_CLEAR));
  ASSERT_EQ(s.drive.state(), StopState::kIdle);
  s.run_profile(3);
  s.answer(old);
  s.drive.trip(Trip::kOperatorStop);
  s.turn();
  EXPECT_GT(s.last(IMRIG_TRIP).seq, old.seq);
}

}  // namespace
}  // namespace imrig
