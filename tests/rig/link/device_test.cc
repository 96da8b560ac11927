#include <gtest/gtest.h>

#include <algorithm>

#include "rig/base/space_vector.h"
#include "rig/link/device/imrig_device.h"
#include "tests/rig/link/device_bench.h"

namespace imrig::test {
namespace {

class Device : public testing::Test {
 protected:
  DeviceBench bench;
  imrig_device& device() { return *bench.device; }

  void run_to_hold(std::int32_t profile_id = 1) {
    ASSERT_EQ(bench.upload(profile_id, {voltage_segment(400, 0, 100, 0, 50)}, IMRIG_AT_END_HOLD), IMRIG_DONE);
    ASSERT_EQ(bench.order(IMRIG_START, profile_id), IMRIG_DONE);
    bench.samples(420);
    ASSERT_EQ(device().state, IMRIG_HOLDING);
  }
  const imrig_status& last_status() { return bench.heard.statuses.back(); }
};

TEST_F(Device, SaysNothingAndListensToNobodyBeforeAHello) {
  EXPECT_EQ(bench.upload(1, {off_segment(10)}, 0), -99);
  bench.samples(1000);
  bench.tick(5000);
  EXPECT_TRUE(bench.heard.blocks.empty());
  EXPECT_TRUE(bench.heard.statuses.empty());
  bench.hello();
  bench.drain();
  ASSERT_EQ(bench.heard.welcomes.size(), 1u);
  const imrig_welcome& w = bench.heard.welcomes[0];
  EXPECT_EQ(w.boot_id, 4711);
  EXPECT_EQ(w.host_nonce, 1);
  EXPECT_EQ(w.next_index, 1000);
  EXPECT_EQ(w.next_block, 0);
  EXPECT_EQ(w.pwm_time_ns, 240000);
  EXPECT_EQ(w.max_segments, 24);
}

TEST_F(Device, RefusesAHelloWithLimitsThatAreNone) {
  for (const double bad : {kNan, 0.0, -1.0, static_cast<double>(INFINITY)}) {
    imrig_hello hello = bench_hello();
    hello.current_limit_A = bad;
    bench.say(hello);
  }
  imrig_hello hello = bench_hello();
  hello.watchdog_ms = 10;
  bench.say(hello);
  bench.drain();
  EXPECT_TRUE(bench.heard.welcomes.empty());
  EXPECT_EQ(device().bad_frames, 5);
}

TEST_F(Device, StartsAtThePwmCycleAndEachSegmentFallsOnItsSample) {
  bench.hello();
  bench.samples(2);
  imrig_segment first = voltage_segment(40, 10, 10, 0, 0), second = voltage_segment(300, 20, 20, 0, 0);
  first.record = 7;
  ASSERT_EQ(bench.upload(3, {first, second}, IMRIG_AT_END_GATES_OFF), IMRIG_DONE);
  ASSERT_EQ(bench.order(IMRIG_START, 3), IMRIG_DONE);
  // The command returned for sample k acts from sample k+1 on; the first multiple of 4 that can be reached
  // from sample 2 on is 4.
  const auto commands = bench.samples(400);
  EXPECT_EQ(commands[0].legs, 0u);
  EXPECT_EQ(commands[1].legs, 7u);  // of sample 3: command 4
  EXPECT_NEAR(commands[1].v_V[0], 10.0, 1e-12);
  EXPECT_NEAR(commands[1 + 39].v_V[0], 10.0, 1e-12);
  EXPECT_NEAR(commands[1 + 40].v_V[0], 20.0, 1e-12);
  EXPECT_EQ(commands[1 + 339].legs, 7u);
  EXPECT_EQ(commands[1 + 340].legs, 0u);
  bench.samples(256);
  ASSERT_GE(bench.heard.blocks.size(), 5u);
  const auto expect_block = [&](int k, std::int64_t at, int n, int segment, int record, int gates) {
    const imrig_block& b = bench.heard.blocks[static_cast<std::size_t>(k)];
    EXPECT_EQ(b.seq, k);
    EXPECT_EQ(b.first_index, at);
    EXPECT_EQ(b.utime, at * 60);
    EXPECT_EQ(b.n, n);
    EXPECT_EQ(b.segment, segment);
    EXPECT_EQ(b.record, record);
    EXPECT_EQ(b.gates_on, gates);
    EXPECT_EQ(b.profile_id, segment < 0 ? 0 : 3);
  };
  expect_block(0, 0, 4, -1, 0, 0);
  expect_block(1, 4, 40, 0, 7, 1);
  expect_block(2, 44, 256, 1, 0, 1);
  expect_block(3, 300, 44, 1, 0, 1);
  expect_block(4, 344, 256, -1, 0, 0);
}

TEST_F(Device, BlocksCarryTheCountsAsTheyCame) {
  bench.hello();
  for (int k = 0; k < 256; ++k) {
    bench.counts = {
        {static_cast<std::int16_t>(k), static_cast<std::int16_t>(-k), 3}, {2047, -2048, 0}, -5 * k, 25.5f};
    bench.sample();
  }
  ASSERT_EQ(bench.heard.blocks.size(), 1u);
  const imrig_block& b = bench.heard.blocks[0];
  for (int k = 0; k < 256; ++k) {
    EXPECT_EQ(b.i_a[k], k);
    EXPECT_EQ(b.i_b[k], -k);
    EXPECT_EQ(b.i_c[k], 3);
    EXPECT_EQ(b.v_a[k], 2047);
    EXPECT_EQ(b.v_b[k], -2048);
    EXPECT_EQ(b.encoder[k], -5 * k);
  }
  EXPECT_EQ(b.stator_C, 25.5f);
}

TEST_F(Device, ContinuesTheAngleFromOneProfileIntoTheNext) {
  bench.hello();
  run_to_hold(1);
  // Held at 50 Hz and 100 V; the next profile steps the amplitude only.
  std::vector<imrig_segment> step = {voltage_segment(800, 110, 110, 50, 50)};
  ASSERT_EQ(bench.upload(2, step, IMRIG_AT_END_HOLD), IMRIG_DONE);
  EXPECT_EQ(device().state, IMRIG_HOLDING);
  std::vector<SpaceVector> vectors;
  const auto take = [&](int n) {
    for (const auto& c : bench.samples(n)) {
      EXPECT_EQ(c.legs, 7u);  // never opened in between
      vectors.push_back(space_vector(c.v_V[0], c.v_V[1], c.v_V[2]));
    }
  };
  take(100);
  ASSERT_EQ(bench.order(IMRIG_START, 2), IMRIG_DONE);
  take(1000);
  EXPECT_EQ(device().state, IMRIG_HOLDING);
  EXPECT_EQ(last_status().profile_id, 2);
  bool stepped = false;
  for (std::size_t k = 4; k < vectors.size(); ++k) {
    const double turned = std::arg(vectors[k] / vectors[k - 4]);
    ASSERT_NEAR(turned, 2 * kPi * 50 * 4 * kSample_s, 1e-9);
    stepped = stepped || std::abs(std::abs(vectors[k]) - std::abs(vectors[k - 4])) > 9.9;
  }
  EXPECT_TRUE(stepped);
}

TEST_F(Device, StartsFromIdleWithAngleZero) {
  bench.hello();
  run_to_hold(1);
  bench.order(IMRIG_STOP);
  EXPECT_EQ(bench.sample().legs, 0u);
  EXPECT_EQ(device().state, IMRIG_IDLE);
  ASSERT_EQ(bench.upload(2, {voltage_segment(400, 50, 50, 30, 30)}, 0), IMRIG_DONE);
  bench.order(IMRIG_START, 2);
  const auto commands = bench.samples(6);
  const auto first =
      std::find_if(commands.begin(), commands.end(), [](const imrig_command& c) { return c.legs != 0; });
  ASSERT_NE(first, commands.end());
  EXPECT_NEAR(first->v_V[0], 50.0, 1e-12);
}

TEST_F(Device, StopRampsDownAndThenOpensTheGates) {
  bench.hello();
  run_to_hold();
  ASSERT_EQ(bench.order(IMRIG_STOP, 0, 0.06), IMRIG_DONE);
  EXPECT_EQ(device().state, IMRIG_STOPPING);
  const auto commands = bench.samples(1001);
  for (int k = 0; k < 1000; ++k) ASSERT_EQ(commands[static_cast<std::size_t>(k)].legs, 7u) << k;
  EXPECT_EQ(commands[1000].legs, 0u);
  EXPECT_EQ(device().state, IMRIG_IDLE);
  EXPECT_EQ(last_status().profile_id, 0);
}

TEST_F(Device, StopCanBeHastenedButNotDelayed) {
  bench.hello();
  run_to_hold();
  bench.order(IMRIG_STOP, 0, 0.6);
  bench.samples(100);
  EXPECT_EQ(bench.order(IMRIG_STOP, 0, 10.0), IMRIG_DONE);
  EXPECT_LE(device().drive.ramp_samples, 10000);
  const double before = std::abs(space_vector(device().drive.command.v_V[0], device().drive.command.v_V[1],
                                              device().drive.command.v_V[2]));
  EXPECT_EQ(bench.order(IMRIG_STOP, 0, 0.006), IMRIG_DONE);
  const imrig_command next = bench.samples(4).back();
  EXPECT_NEAR(std::abs(space_vector(next.v_V[0], next.v_V[1], next.v_V[2])), before,
              0.05 * before);  // no jump
  bench.samples(100);
  EXPECT_EQ(device().state, IMRIG_IDLE);
}

TEST_F(Device, AnswersTheSameRequestAgainAndActsOnce) {
  bench.hello();
  ASSERT_EQ(bench.upload(1, {voltage_segment(100, 0, 10, 0, 5)}, IMRIG_AT_END_GATES_OFF), IMRIG_DONE);
  const imrig_order start = {0, 500, 1, IMRIG_START, 1, 0.0};
  bench.say(start);
  bench.say(start);
  bench.samples(300);
  EXPECT_EQ(device().state, IMRIG_IDLE);  // ran once, is over
  bench.say(start);
  bench.samples(300);
  EXPECT_EQ(device().state, IMRIG_IDLE);
  int answers = 0;
  for (const auto& reply : bench.heard.replies) {
    if (reply.of_seq == 500) {
      ++answers;
      EXPECT_EQ(reply.result, IMRIG_DONE);
    }
  }
  EXPECT_EQ(answers, 3);
  const auto started =
      std::count_if(bench.heard.statuses.begin(), bench.heard.statuses.end(),
                    [](const imrig_status& s) { return s.state == IMRIG_RUNNING && s.next_index < 300; });
  EXPECT_GT(started, 0);
}

TEST_F(Device, RefusesAnOrderThatALaterOneHasOvertaken) {
  bench.hello();
  ASSERT_EQ(bench.upload(1, {voltage_segment(100, 0, 10, 0, 5)}, 0), IMRIG_DONE);
  bench.say(imrig_order{0, 601, 1, IMRIG_STOP, 0, 0.0});
  bench.say(imrig_order{0, 600, 1, IMRIG_START, 1, 0.0});
  EXPECT_EQ(bench.last_result(), IMRIG_OVERTAKEN);
  bench.samples(20);
  EXPECT_EQ(device().state, IMRIG_IDLE);
}

TEST_F(Device, SaysWhyItRefuses) {
  bench.hello();
  EXPECT_EQ(bench.order(IMRIG_START, 1), IMRIG_NO_PROFILE);
  EXPECT_EQ(bench.order(9), IMRIG_MALFORMED);
  EXPECT_EQ(bench.order(IMRIG_STOP, 0, kNan), IMRIG_MALFORMED);
  EXPECT_EQ(bench.upload(1, {voltage_segment(100, 0, 231, 0, 5)}, 0), IMRIG_OVER_LIMIT);
  EXPECT_EQ(bench.upload(0, {off_segment(1)}, 0), IMRIG_MALFORMED);
  bench.say(imrig_commit{0, ++bench.seq, 1, 77, 1, 0});
  EXPECT_EQ(bench.last_result(), IMRIG_INCOMPLETE);
  ASSERT_EQ(bench.upload(5, {off_segment(10), off_segment(10)}, 0), IMRIG_DONE);
  bench.say(imrig_commit{0, ++bench.seq, 1, 5, 3, 0});
  EXPECT_EQ(bench.last_result(), IMRIG_INCOMPLETE);
  bench.say(imrig_commit{0, ++bench.seq, 1, 5, 2, 2});
  EXPECT_EQ(bench.last_result(), IMRIG_MALFORMED);
  EXPECT_EQ(bench.order(IMRIG_START, 5), IMRIG_NO_PROFILE);  // no longer committed
  ASSERT_EQ(bench.upload(6, {voltage_segment(4000, 0, 10, 0, 5)}, 0), IMRIG_DONE);
  ASSERT_EQ(bench.order(IMRIG_START, 6), IMRIG_DONE);
  EXPECT_EQ(bench.order(IMRIG_START, 6), IMRIG_BUSY);
  bench.samples(10);
  ASSERT_EQ(bench.upload(7, {off_segment(10)}, 0), IMRIG_DONE);  // while the other runs
  EXPECT_EQ(bench.order(IMRIG_START, 7), IMRIG_BUSY);
  EXPECT_EQ(last_status().profile_loaded, 7);
}

TEST_F(Device, ChecksTheProfileAgainWhenAHelloHasLoweredTheLimits) {
  bench.hello();
  ASSERT_EQ(bench.upload(1, {voltage_segment(100, 0, 200, 0, 50)}, 0), IMRIG_DONE);
  imrig_hello hello = bench_hello();
  hello.voltage_limit_V = 150.0;
  bench.say(hello);
  EXPECT_EQ(bench.order(IMRIG_START, 1), IMRIG_OVER_LIMIT);
}

// ---- trips

TEST_F(Device, OpensTheGatesAboveTheCurrentLimit) {
  bench.hello();
  run_to_hold();
  const auto counts_for = [](double amplitude_A, double angle) {
    imrig_counts c = {};
    const auto i = phases(std::polar(amplitude_A, angle));
    for (int k = 0; k < 3; ++k)
      c.i[k] = static_cast<std::int16_t>(std::lround(i[static_cast<std::size_t>(k)] / double{kAmpPerCount}));
    c.stator_C = 20.0f;
    return c;
  };
  for (int k = 0; k < 60; ++k) {
    bench.counts = counts_for(29.9, 0.1 * k);
    EXPECT_EQ(bench.sample().legs, 7u);
  }
  bench.counts = counts_for(30.1, 0.7);
  EXPECT_EQ(bench.sample().legs, 0u);
  EXPECT_TRUE(imrig_device_must_be_off(&device()));
  EXPECT_EQ(last_status().state, IMRIG_TRIPPED);
  EXPECT_EQ(last_status().trip, IMRIG_TRIP_OVER_CURRENT);
  EXPECT_NEAR(last_status().current_peak_A, 30.1, 0.02);
}

TEST_F(Device, TripsOnSpeedFromEncoderCountsAlsoAcrossTheWrap) {
  bench.hello();
  const auto turn = [&](double rpm, int samples, std::int32_t from) {
    for (int k = 0; k < samples; ++k) {
      const double counts = rpm / 60.0 * 4096 * kSample_s * k;
      bench.counts.encoder = static_cast<std::int32_t>(
          static_cast<std::uint32_t>(from) + static_cast<std::uint32_t>(static_cast<std::int64_t>(counts)));
      bench.sample();
    }
  };
  turn(-2900.0, 2000, 2147483000);
  EXPECT_NEAR(device().speed_rpm, -2900.0, 3.0);
  EXPECT_EQ(device().state, IMRIG_IDLE);
  DeviceBench other;
  other.hello();
  std::swap(bench, other);
  turn(3100.0, 2000, 2147483000);  // passes 2^31
  EXPECT_EQ(device().trip, IMRIG_TRIP_OVER_SPEED);
}

TEST_F(Device, TripsOnTemperatureAndNotWithoutASensor) {
  bench.hello();
  bench.counts.stator_C = std::numeric_limits<float>::quiet_NaN();
  bench.samples(10);
  bench.counts.stator_C = 129.0f;
  bench.samples(10);
  EXPECT_EQ(device().state, IMRIG_IDLE);
  bench.counts.stator_C = 131.0f;
  bench.samples(1);
  EXPECT_EQ(last_status().trip, IMRIG_TRIP_OVER_TEMPERATURE);
}

TEST_F(Device, WatchdogTripsWhileDrivingAndOnlyThen) {
  bench.hello();
  bench.tick(bench.now_ms + 10000);
  EXPECT_EQ(device().state, IMRIG_IDLE);
  bench.hello();
  run_to_hold();
  bench.tick(bench.now_ms + 299);
  EXPECT_EQ(device().state, IMRIG_HOLDING);
  bench.say(imrig_credit{0, ++bench.seq, 1, 0});  // any frame of the host will do
  bench.tick(bench.now_ms + 299);
  EXPECT_EQ(device().state, IMRIG_HOLDING);
  bench.feed({1, 2, 3, 4, 0, 5, 5, 0});  // noise will not
  bench.tick(bench.now_ms + 2);
  EXPECT_EQ(device().trip, IMRIG_TRIP_WATCHDOG);
  EXPECT_EQ(bench.sample().legs, 0u);
  EXPECT_EQ(device().bad_frames, 2);
}

TEST_F(Device, KeepsTheFirstCauseUntilClearedAndForgetsItsProfiles) {
  bench.hello();
  run_to_hold();
  ASSERT_EQ(bench.upload(2, {off_segment(10)}, 0), IMRIG_DONE);
  EXPECT_EQ(bench.order(IMRIG_TRIP), IMRIG_DONE);
  EXPECT_TRUE(imrig_device_must_be_off(&device()));
  bench.counts.i[0] = 2047;  // over-current now as well
  bench.samples(2);
  EXPECT_EQ(last_status().trip, IMRIG_TRIP_ORDERED);
  EXPECT_EQ(last_status().profile_loaded, 0);
  bench.counts.i[0] = 0;
  EXPECT_EQ(bench.order(IMRIG_START, 2), IMRIG_IS_TRIPPED);
  EXPECT_EQ(bench.order(IMRIG_STOP), IMRIG_IS_TRIPPED);
  EXPECT_EQ(bench.upload(3, {off_segment(10)}, 0), IMRIG_IS_TRIPPED);
  EXPECT_EQ(bench.order(IMRIG_CLEAR), IMRIG_DONE);
  EXPECT_EQ(last_status().state, IMRIG_IDLE);
  EXPECT_EQ(last_status().trip, IMRIG_TRIP_NONE);
  EXPECT_EQ(bench.order(IMRIG_START, 2), IMRIG_NO_PROFILE);
}

// ---- sessions and credit

TEST_F(Device, KeepsToAHostThatIsHeardAndTakesAnotherOnceItIsSilent) {
  bench.hello(1);
  bench.drain();
  bench.say(imrig_credit{0, 2, 1, 1});
  bench.hello(2);
  bench.drain();
  EXPECT_EQ(bench.heard.welcomes.size(), 1u);
  bench.samples(100);
  bench.tick(bench.now_ms + 301);
  bench.hello(2);
  bench.drain();
  ASSERT_EQ(bench.heard.welcomes.size(), 2u);
  EXPECT_EQ(bench.heard.welcomes[1].host_nonce, 2);
  EXPECT_EQ(bench.heard.welcomes[1].next_index, 100);
  // The new host's numbers start anew: seq 101 is not "answered before".
  bench.seq = 0;
  EXPECT_EQ(bench.upload(1, {off_segment(4)}, 0), IMRIG_DONE);
  bench.samples(256);
  EXPECT_EQ(bench.heard.blocks.at(0).seq, bench.heard.welcomes[1].next_block);
}

TEST_F(Device, WaitsForCreditWhereItCanWait) {
  imrig_device_config config = bench_config();
  config.waits_for_credit = 1;
  bench = DeviceBench(config);
  EXPECT_FALSE(imrig_device_may_sample(&device()));
  bench.hello();
  EXPECT_FALSE(imrig_device_may_sample(&device()));
  bench.say(imrig_credit{0, 2, 1, 300});
  bench.say(imrig_credit{0, 1, 1, 200});  // late: never moves back
  int taken = 0;
  for (; imrig_device_may_sample(&device()) && taken < 1000; ++taken) bench.sample();
  EXPECT_EQ(taken, 300);
}

TEST_F(Device, TellsItsStatusEveryTenMillisecondsOfItsTimeAndAtLeastEveryHundredOfTheHosts) {
  bench.hello();
  bench.samples(1);
  bench.heard.statuses.clear();
  bench.samples(16700);  // 1.002 s
  EXPECT_NEAR(static_cast<double>(bench.heard.statuses.size()), 100.0, 1.0);
  bench.heard.statuses.clear();
  for (int k = 0; k < 100; ++k) bench.tick(bench.now_ms + 10);  // out of credit, say
  EXPECT_NEAR(static_cast<double>(bench.heard.statuses.size()), 10.0, 1.0);
}

TEST_F(Device, NumbersBlocksItHadToDrop) {
  bench.hello();
  bench.drain();
  for (int k = 0; k < 7 * 256; ++k) imrig_device_sample(&device(), &bench.counts);  // nobody takes them
  bench.drain();
  ASSERT_EQ(bench.heard.blocks.size(), 4u);
  bench.samples(512);
  ASSERT_EQ(bench.heard.blocks.size(), 6u);
  EXPECT_EQ(bench.heard.blocks[3].seq, 3);
  EXPECT_EQ(bench.heard.blocks[4].seq, 7);
  EXPECT_EQ(bench.heard.blocks[4].first_index, 7 * 256);
}

}  // namespace
}  // namespace imrig::test
