// The bridge core against the device core that firmware runs, on a wire in memory.

#include "rig/bridge/bridge_core.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/rig/bridge/bench.h"

namespace imrig {
namespace {

using imrig_msg::bridge_cmd_t;
using imrig_msg::bridge_status_t;
using imrig_msg::heartbeat_t;

void expect_contiguous(const std::vector<imrig_msg::samples_t>& blocks) {
  for (std::size_t k = 1; k < blocks.size(); ++k) {
    ASSERT_EQ(blocks[k].seq, blocks[k - 1].seq + 1);
    ASSERT_EQ(blocks[k].first_index, blocks[k - 1].first_index + blocks[k - 1].n);
  }
}

// ---- samples

TEST(BridgeCore, EveryBlockBecomesOneMessageInOrder) {
  Bench bench;
  bench.counts.i[0] = 100;
  bench.run_ms(2000);
  ASSERT_GT(bench.samples.size(), 100u);
  expect_contiguous(bench.samples);
  const auto& last = bench.samples.back();
  EXPECT_GT(last.first_index + last.n, bench.device.next_index - 257);
  EXPECT_EQ(last.i_a.at(0), 100);
  EXPECT_EQ(last.boot_id, bench.device.config.boot_id);
  EXPECT_EQ(last.sample_time_ns, 60'000);
  EXPECT_EQ(last.utime, last.first_index * 60);
  EXPECT_FLOAT_EQ(last.current_A_per_count, 0.025f);
  EXPECT_EQ(bench.status().lost_blocks, 0);
}

TEST(BridgeCore, LostBlocksAreCountedAndTheRestGoesOn) {
  Bench bench;
  bench.run_ms(200);
  int packets = 0;
  bench.loses = [&](std::span<const std::uint8_t> packet) {
    return packet.size() > 1000 && ++packets % 5 == 0;
  };
  bench.run_ms(1000);
  bench.loses = nullptr;
  bench.run_ms(200);
  std::int64_t missing = 0;
  for (std::size_t k = 1; k < bench.samples.size(); ++k)
    missing += bench.samples[k].seq - bench.samples[k - 1].seq - 1;
  EXPECT_EQ(missing, packets / 5);
  EXPECT_EQ(bench.status().lost_blocks, missing);
  EXPECT_EQ(bench.core->state(), StopState::kIdle) << "nothing drives, nothing trips";
}

TEST(BridgeCore, StatusLeaseAndHeartbeatComeAtTheirRates) {
  Bench bench;
  bench.run_ms(500);
  const auto statuses = bench.statuses.size(), heartbeats = bench.heartbeats.size(),
             leases = bench.leases.size();
  bench.run_ms(2000);
  EXPECT_NEAR(static_cast<double>(bench.statuses.size() - statuses), 40.0, 2.0);
  EXPECT_NEAR(static_cast<double>(bench.heartbeats.size() - heartbeats), 10.0, 1.0);
  EXPECT_NEAR(static_cast<double>(bench.leases.size() - leases), 20.0, 1.0);
}

// ---- the way of a profile

TEST(BridgeCore, ProfileRunsToItsEndAndTheGatesOpen) {
  Bench bench;
  bench.run_ms(50);
  ASSERT_TRUE(bench.take_lease());
  ASSERT_EQ(bench.upload_voltage(3, 50.0, 30.0, 5000), CommandResult::kDone);
  EXPECT_EQ(bench.status().profile_loaded, 3);
  EXPECT_FALSE(bench.gates_on());
  ASSERT_EQ(bench.act(bridge_cmd_t::START, 3), CommandResult::kDone);
  EXPECT_EQ(bench.status().run_state, bridge_status_t::RUNNING);
  EXPECT_EQ(bench.status().profile_id, 3);
  bench.run_ms(100);
  EXPECT_TRUE(bench.gates_on());
  EXPECT_EQ(bench.status().segment, 0);
  ASSERT_TRUE(bench.run_until([&] { return bench.core->state() == StopState::kIdle; }, 400));
  EXPECT_FALSE(bench.gates_on());
  EXPECT_EQ(bench.status().profile_id, 0);
  EXPECT_EQ(bench.status().trip, 0);
  std::int64_t driven = 0;
  for (const auto& block : bench.samples) driven += block.profile_id == 3 ? block.n : 0;
  EXPECT_EQ(driven, 5000);
}

TEST(BridgeCore, ShortestProfileIsSeenToItsEnd) {
  for (const std::int32_t at_end : {0, 1}) {
    Bench bench;
    bench.run_ms(50);
    ASSERT_TRUE(bench.take_lease());
    ASSERT_EQ(bench.upload_voltage(3, 50.0, 30.0, 1, at_end), CommandResult::kDone);
    ASSERT_EQ(bench.act(bridge_cmd_t::START, 3), CommandResult::kDone);
    const StopState end = at_end == bridge_cmd_t::AT_END_HOLD ? StopState::kHolding : StopState::kIdle;
    EXPECT_TRUE(bench.run_until([&] { return bench.core->state() == end; }, 200)) << at_end;
  }
}

TEST(BridgeCore, HeldProfileGoesOnIntoTheNextOneWithoutOpeningTheGates) {
  Bench bench;
  bench.run_ms(50);
  ASSERT_TRUE(bench.take_lease());
  ASSERT_EQ(bench.upload_voltage(1, 50.0, 30.0, 1000, bridge_cmd_t::AT_END_HOLD), CommandResult::kDone);
  ASSERT_EQ(bench.act(bridge_cmd_t::START, 1), CommandResult::kDone);
  ASSERT_TRUE(bench.run_until([&] { return bench.core->state() == StopState::kHolding; }, 500));
  EXPECT_EQ(bench.status().holding, 1);
  EXPECT_EQ(bench.status().profile_id, 1);
  ASSERT_EQ(bench.upload_voltage(2, 60.0, 30.0, 1000, bridge_cmd_t::AT_END_HOLD), CommandResult::kDone);
  EXPECT_EQ(bench.core->state(), StopState::kHolding);
  const std::size_t before = bench.samples.size();
  ASSERT_EQ(bench.act(bridge_cmd_t::START, 2), CommandResult::kDone);
  ASSERT_TRUE(bench.run_until([&] { return bench.core->state() == StopState::kHolding; }, 500));
  EXPECT_EQ(bench.status().profile_id, 2);
  bench.run_ms(50);
  for (std::size_t k = before; k < bench.samples.size(); ++k) EXPECT_EQ(bench.samples[k].gates_on, 1);
  EXPECT_EQ(bench.act(bridge_cmd_t::STOP), CommandResult::kDone);
  EXPECT_EQ(bench.core->state(), StopState::kStopping);
  ASSERT_TRUE(bench.run_until([&] { return bench.core->state() == StopState::kIdle; }, 1000));
  EXPECT_FALSE(bench.gates_on());
}

TEST(BridgeCore, ProfilesOverTheLimitsNeverReachTheDevice) {
  Bench bench;
  bench.run_ms(50);
  ASSERT_TRUE(bench.take_lease());
  EXPECT_EQ(bench.upload_voltage(1, 200.1), CommandResult::kOverLimit);
  EXPECT_EQ(bench.upload_voltage(1, std::nan("")), CommandResult::kMalformed);
  EXPECT_EQ(bench.upload_voltage(0), CommandResult::kMalformed);
  EXPECT_EQ(bench.upload_voltage(1, 50.0, 30.0, 0), CommandResult::kMalformed);
  EXPECT_EQ(bench.upload_voltage(1, 50.0, 30.0, 100, 2), CommandResult::kMalformed);
  bridge_cmd_t cmd = {};
  cmd.action = bridge_cmd_t::UPLOAD;
  cmd.profile_id = 1;
  for (const std::int32_t n : {0, -1, 25, INT32_MAX, INT32_MIN}) {
    cmd.n_segments = n;
    EXPECT_EQ(bench.send(cmd), CommandResult::kMalformed) << n;
  }
  EXPECT_EQ(bench.device.banks[0].have | bench.device.banks[1].have, 0u);
  EXPECT_EQ(bench.act(bridge_cmd_t::START, 1), CommandResult::kDeviceNoProfile);
  EXPECT_EQ(bench.act(99), CommandResult::kMalformed);
}

// ---- leases and commands

TEST(BridgeCore, NothingMovesWithoutTheLease) {
  Bench bench;
  bench.run_ms(50);
  EXPECT_EQ(bench.upload_voltage(1), CommandResult::kNoLease);
  bench.start_motor();
  bridge_cmd_t cmd = {};
  cmd.bridge_cmd_v1 = 1;
  cmd.action = bridge_cmd_t::STOP;
  cmd.lease_epoch = bench.client.epoch() + 1;
  cmd.seq = 1000;
  cmd.issued_host_utime = bench.now.wall_us;
  cmd.ttl_ms = 1000;
  bench.core->on_bridge_cmd(cmd, bench.now);
  bench.run_ms(20);
  EXPECT_EQ(bench.core->state(), StopState::kRunning);
}

TEST(BridgeCore, CommandActsOnceAndTheHoldersAnswerStays) {
  Bench bench;
  bench.run_ms(50);
  ASSERT_TRUE(bench.take_lease());
  ASSERT_EQ(bench.upload_voltage(1), CommandResult::kDone);
  bridge_cmd_t cmd = {};
  cmd.action = bridge_cmd_t::START;
  cmd.profile_id = 1;
  ASSERT_EQ(bench.send(cmd), CommandResult::kDone);
  bench.run_ms(50);
  ASSERT_EQ(bench.act(bridge_cmd_t::STOP), CommandResult::kDone);
  ASSERT_TRUE(bench.run_until([&] { return bench.core->state() == StopState::kIdle; }, 1000));
  const std::size_t before = bench.statuses.size();
  bench.core->on_bridge_cmd(cmd, bench.now);  // the same bytes again
  bench.run_ms(100);
  EXPECT_EQ(bench.core->state(), StopState::kIdle);
  EXPECT_TRUE(std::any_of(bench.statuses.begin() + static_cast<std::ptrdiff_t>(before), bench.statuses.end(),
                          [&](const auto& s) {
                            return s.last_cmd_seq == cmd.seq &&
                                   s.last_cmd_result == static_cast<std::int32_t>(CommandResult::kNotNew);
                          }));
  EXPECT_EQ(bench.status().last_cmd_seq, cmd.seq + 1);
  EXPECT_EQ(bench.status().last_cmd_result, 0);
}

TEST(BridgeCore, SecondCommandMustWaitForTheFirst) {
  Bench bench;
  bench.run_ms(50);
  ASSERT_TRUE(bench.take_lease());
  bench.wire_up = false;  // the device's answer is late
  bridge_cmd_t cmd = {};
  cmd.bridge_cmd_v1 = 1;
  cmd.action = bridge_cmd_t::UPLOAD;
  cmd.profile_id = 1;
  cmd.n_segments = 1;
  cmd.segments[0].kind = 1;
  cmd.segments[0].duration_samples = 1000;
  bench.client.sign(cmd, bench.now);
  bench.core->on_bridge_cmd(cmd, bench.now);
  bridge_cmd_t second = cmd;
  bench.client.sign(second, bench.now);
  bench.core->on_bridge_cmd(second, bench.now);
  bench.run_ms(1);
  EXPECT_TRUE(std::any_of(bench.statuses.begin(), bench.statuses.end(), [&](const auto& s) {
    return s.last_cmd_seq == second.seq &&
           s.last_cmd_result == static_cast<std::int32_t>(CommandResult::kBusy);
  }));
  bench.wire_up = true;
  bench.run_ms(200);
  EXPECT_EQ(bench.status().last_cmd_seq, cmd.seq);
  EXPECT_EQ(bench.status().last_cmd_result, 0);
  EXPECT_EQ(bench.status().profile_loaded, 1);
}

TEST(BridgeCore, LeaseThatEndsWhileTheMotorIsDrivenTrips) {
  Bench bench;
  bench.start_motor();
  bench.client_alive = false;  // kill -9
  const std::int64_t died_us = bench.now.steady_us;
  ASSERT_TRUE(bench.run_until([&] { return bench.core->state() == StopState::kTripped; }, 3000));
  EXPECT_EQ(bench.core->cause(), Trip::kLeaseLost);
  EXPECT_LE(bench.now.steady_us - died_us, std::int64_t{bench.rig.limits.lease_ms} * 1000 + 2000);
  bench.run_ms(2);
  EXPECT_FALSE(bench.gates_on());
}

TEST(BridgeCore, LeaseReleasedWhileHoldingTrips) {
  Bench bench;
  bench.run_ms(50);
  ASSERT_TRUE(bench.take_lease());
  ASSERT_EQ(bench.upload_voltage(1, 50.0, 30.0, 100, bridge_cmd_t::AT_END_HOLD), CommandResult::kDone);
  ASSERT_EQ(bench.act(bridge_cmd_t::START, 1), CommandResult::kDone);
  ASSERT_TRUE(bench.run_until([&] { return bench.core->state() == StopState::kHolding; }, 500));
  bench.client.release();
  bench.run_ms(5);
  EXPECT_EQ(bench.core->cause(), Trip::kLeaseLost);
  EXPECT_FALSE(bench.gates_on());
}

TEST(BridgeCore, LeaseReleasedWhileStoppingOrIdleIsNoTrip) {
  Bench bench;
  bench.start_motor();
  ASSERT_EQ(bench.act(bridge_cmd_t::STOP), CommandResult::kDone);
  bench.client.release();
  ASSERT_TRUE(bench.run_until([&] { return bench.core->state() == StopState::kIdle; }, 1000));
  EXPECT_EQ(bench.core->cause(), Trip::kNone);
  EXPECT_FALSE(bench.gates_on());
}

TEST(BridgeCore, NextHolderCannotStartWhatTheLastOneUploaded) {
  Bench bench;
  bench.run_ms(50);
  ASSERT_TRUE(bench.take_lease());
  ASSERT_EQ(bench.upload_voltage(1), CommandResult::kDone);
  bench.client.release();
  bench.run_ms(50);
  ASSERT_TRUE(bench.take_lease());
  EXPECT_EQ(bench.status().profile_loaded, 0);
  EXPECT_EQ(bench.act(bridge_cmd_t::START, 1), CommandResult::kDeviceNoProfile);
}

TEST(BridgeCore, WallClockJumpsRefuseCommandsAndStopNothing) {
  for (const std::int64_t jump_us : {-3'600'000'000ll, 3'600'000'000ll}) {
    Bench bench;
    bench.start_motor();
    bridge_cmd_t cmd = {};
    cmd.bridge_cmd_v1 = 1;
    cmd.action = bridge_cmd_t::STOP;
    bench.client.sign(cmd, bench.now);  // dated before the jump
    bench.now.wall_us += jump_us;
    bench.core->on_bridge_cmd(cmd, bench.now);
    bench.run_ms(2000);
    EXPECT_EQ(bench.core->state(), StopState::kRunning) << jump_us;  // the lease is renewed in the new time
    EXPECT_EQ(bench.status().last_cmd_result, static_cast<std::int32_t>(CommandResult::kStale)) << jump_us;
  }
}

// ---- trips

TEST(BridgeCore, EmergencyStopOpensTheGatesWithinOneExchange) {
  Bench bench;
  bench.start_motor();
  bench.estop();
  bench.run_ms(1);
  EXPECT_FALSE(bench.gates_on());
  bench.run_ms(20);
  EXPECT_EQ(bench.status().run_state, bridge_status_t::TRIPPED);
  EXPECT_EQ(bench.status().trip, static_cast<std::int32_t>(Trip::kOperatorStop));
  EXPECT_EQ(bench.heartbeats.back().state, heartbeat_t::TRIPPED);
  EXPECT_EQ(bench.heartbeats.back().state_code, static_cast<std::int32_t>(Trip::kOperatorStop));
}

TEST(BridgeCore, TrippedRigTakesNothingButAResetAndDoesNotResume) {
  Bench bench;
  bench.start_motor();
  bench.estop();
  bench.run_ms(20);
  EXPECT_EQ(bench.act(bridge_cmd_t::START, 1), CommandResult::kTripped);
  EXPECT_EQ(bench.act(bridge_cmd_t::STOP), CommandResult::kTripped);
  EXPECT_EQ(bench.upload_voltage(2), CommandResult::kTripped);
  EXPECT_EQ(bench.act(bridge_cmd_t::RESET), CommandResult::kDone);
  bench.run_ms(100);
  EXPECT_EQ(bench.core->state(), StopState::kIdle);
  EXPECT_EQ(bench.device.state, IMRIG_IDLE);
  EXPECT_FALSE(bench.gates_on());
  bench.start_motor(7);
}

TEST(BridgeCore, ResetIsRefusedWhileTheCauseIsThere) {
  Bench bench;
  bench.counts.stator_C = 140.0f;
  bench.run_ms(50);
  ASSERT_EQ(bench.core->state(), StopState::kTripped);
  ASSERT_TRUE(bench.take_lease());
  EXPECT_EQ(bench.act(bridge_cmd_t::RESET), CommandResult::kCauseRemains);
  bench.counts.stator_C = 100.0f;
  bench.run_ms(50);
  EXPECT_EQ(bench.act(bridge_cmd_t::RESET), CommandResult::kDone);
  bench.run_ms(50);
  EXPECT_EQ(bench.core->state(), StopState::kIdle);
}

TEST(BridgeCore, OverCurrentOverSpeedAndOverTemperatureTrip) {
  Bench current;
  current.start_motor();
  current.counts.i[0] = 1400;  // 2/3 of it is 23.3 A, with the others 35 A
  current.counts.i[1] = current.counts.i[2] = -700;
  current.run_ms(20);
  EXPECT_TRUE(current.core->cause() == Trip::kOverCurrent ||
              current.core->cause() == Trip::kDeviceOverCurrent);
  EXPECT_FALSE(current.gates_on());

  Bench speed;
  speed.start_motor();
  ASSERT_TRUE(speed.run_until(
      [&] {
        speed.counts.encoder += 220;  // 3,200 rpm at 4,096 counts and a millisecond a step
        return speed.core->state() == StopState::kTripped;
      },
      100));
  EXPECT_TRUE(speed.core->cause() == Trip::kOverSpeed || speed.core->cause() == Trip::kDeviceOverSpeed);
  EXPECT_FALSE(speed.gates_on());

  Bench heat;
  heat.start_motor();
  heat.counts.stator_C = 131.0f;
  heat.run_ms(20);
  EXPECT_TRUE(heat.core->cause() == Trip::kOverTemperature ||
              heat.core->cause() == Trip::kDeviceOverTemperature);
  EXPECT_FALSE(heat.gates_on());
}

TEST(BridgeCore, BridgeHasLimitsOfItsOwn) {
  Bench bench;
  bench.start_motor();
  for (auto& count : bench.counts.i)
    count = 2047;  // all clipped alike: the device sees no space vector at all
  bench.run_ms(30);
  EXPECT_EQ(bench.core->cause(), Trip::kOverCurrent);
  EXPECT_FALSE(bench.gates_on());
  EXPECT_EQ(bench.device.trip, IMRIG_TRIP_ORDERED);
}

TEST(BridgeCore, SilentLinkTripsBothSidesAndNothingResumes) {
  Bench bench;
  bench.start_motor();
  bench.wire_up = false;
  const std::int64_t cut_us = bench.now.steady_us;
  std::int64_t gates_off_us = 0;
  ASSERT_TRUE(bench.run_until(
      [&] {
        if (gates_off_us == 0 && !bench.gates_on()) gates_off_us = bench.now.steady_us;
        return bench.core->state() == StopState::kTripped;
      },
      2000));
  EXPECT_EQ(bench.core->cause(), Trip::kLinkSilent);
  EXPECT_LE(bench.now.steady_us - cut_us, std::int64_t{bench.rig.limits.link_silence_ms} * 1000 + 20'000);
  ASSERT_GT(gates_off_us, 0);
  EXPECT_LE(gates_off_us - cut_us, std::int64_t{bench.rig.limits.device_watchdog_ms} * 1000 + 20'000);
  bench.run_ms(1000);
  EXPECT_EQ(bench.status().link_state, bridge_status_t::LINK_SILENT);
  EXPECT_EQ(bench.act(bridge_cmd_t::RESET), CommandResult::kLinkAbsent);
  bench.wire_up = true;
  bench.run_ms(1000);
  EXPECT_EQ(bench.status().link_state, bridge_status_t::LINK_UP);
  EXPECT_EQ(bench.core->cause(), Trip::kLinkSilent);
  EXPECT_FALSE(bench.gates_on());
  EXPECT_EQ(bench.act(bridge_cmd_t::RESET), CommandResult::kDone);
  bench.run_ms(50);
  EXPECT_EQ(bench.core->state(), StopState::kIdle);
}

TEST(BridgeCore, SilentLinkWhileIdleIsNoTripAndRecovers) {
  Bench bench;
  bench.run_ms(100);
  bench.wire_up = false;
  bench.run_ms(1000);
  EXPECT_EQ(bench.status().link_state, bridge_status_t::LINK_SILENT);
  EXPECT_EQ(bench.heartbeats.back().state, heartbeat_t::DEGRADED);
  EXPECT_EQ(bench.core->state(), StopState::kIdle);
  bench.wire_up = true;
  bench.run_ms(1000);
  EXPECT_EQ(bench.status().link_state, bridge_status_t::LINK_UP);
  EXPECT_EQ(bench.core->state(), StopState::kIdle);
  bench.start_motor();
}

TEST(BridgeCore, AbsentDeviceIsSaid) {
  Bench bench;
  bench.wire_up = false;
  bench.run_ms(1000);
  EXPECT_EQ(bench.status().link_state, bridge_status_t::LINK_ABSENT);
  EXPECT_EQ(bench.heartbeats.back().state, heartbeat_t::DEGRADED);
  ASSERT_TRUE(bench.take_lease());
  EXPECT_EQ(bench.upload_voltage(1), CommandResult::kLinkAbsent);
}

TEST(BridgeCore, DeviceThatRebootsWhileDrivingTrips) {
  Bench bench;
  bench.start_motor();
  bench.reboot_device();
  ASSERT_TRUE(bench.run_until([&] { return bench.core->state() == StopState::kTripped; }, 2000));
  EXPECT_TRUE(bench.core->cause() == Trip::kDeviceRebooted || bench.core->cause() == Trip::kLinkSilent);
  bench.run_ms(1000);
  EXPECT_EQ(bench.status().link_state, bridge_status_t::LINK_UP);
  EXPECT_EQ(bench.status().boot_id, bench.device.config.boot_id);
  EXPECT_EQ(bench.core->state(), StopState::kTripped);
  EXPECT_FALSE(bench.gates_on());
}

TEST(BridgeCore, BridgeThatRestartsWhileTheMotorRunsTakesNothingOver) {
  Bench bench;
  bench.start_motor();
  bench.restart_bridge();
  bench.run_ms(2000);
  EXPECT_FALSE(bench.gates_on());
  EXPECT_EQ(bench.status().link_state, bridge_status_t::LINK_UP);
  EXPECT_EQ(bench.core->state(), StopState::kTripped);
}

TEST(BridgeCore, TooManyLostBlocksTripOnlyWhileDriving) {
  RigConfig rig = Bench::default_rig();
  rig.limits.max_lost_blocks = 3;
  Bench bench(rig);
  const auto lose_blocks = [](std::span<const std::uint8_t> packet) { return packet.size() > 1000; };
  bench.run_ms(100);
  bench.loses = lose_blocks;
  bench.run_ms(200);
  bench.loses = nullptr;
  bench.run_ms(100);
  EXPECT_GT(bench.status().lost_blocks, 3);
  EXPECT_EQ(bench.core->state(), StopState::kIdle);
  ASSERT_TRUE(bench.take_lease());
  ASSERT_EQ(bench.upload_voltage(1), CommandResult::kDone);
  ASSERT_EQ(bench.act(bridge_cmd_t::START, 1), CommandResult::kDone);
  bench.run_ms(100);
  EXPECT_EQ(bench.core->state(), StopState::kRunning) << "what was lost before the start does not count";
  bench.loses = lose_blocks;
  bench.run_ms(200);
  bench.loses = nullptr;
  bench.run_ms(100);
  EXPECT_EQ(bench.core->cause(), Trip::kSamplesLost);
  EXPECT_FALSE(bench.gates_on());
}

// ---- the dyno

TEST(BridgeCore, RigWithoutADynoRuns) {
  Bench bench;
  bench.start_motor();
  bench.run_ms(10'000);
  EXPECT_EQ(bench.core->state(), StopState::kRunning);
}

TEST(BridgeCore, DynoThatFallsSilentWhileTheMotorRunsTrips) {
  Bench bench;
  bench.dyno_beats(heartbeat_t::OK);
  bench.start_motor();
  for (int k = 0; k < 20; ++k) {
    bench.dyno_beats(heartbeat_t::OK);
    bench.run_ms(200);
  }
  ASSERT_EQ(bench.core->state(), StopState::kRunning);
  bench.run_ms(bench.rig.limits.peer_silence_ms - 300);
  ASSERT_EQ(bench.core->state(), StopState::kRunning);
  bench.run_ms(400);
  EXPECT_EQ(bench.core->cause(), Trip::kPeerSilent);
  EXPECT_FALSE(bench.gates_on());
  EXPECT_EQ(bench.act(bridge_cmd_t::RESET), CommandResult::kDone);
  bench.run_ms(50);
  bench.start_motor(4);  // the reset has written the silent dyno off
}

TEST(BridgeCore, DynoThatTripsTakesTheMotorAlong) {
  Bench bench;
  bench.dyno_beats(heartbeat_t::OK);
  bench.start_motor();
  bench.dyno_beats(heartbeat_t::TRIPPED);
  bench.run_ms(1);
  EXPECT_EQ(bench.core->cause(), Trip::kPeerTripped);
  EXPECT_FALSE(bench.gates_on());
}

TEST(BridgeCore, MotorDoesNotStartBesideATrippedDynoAndCanBeResetBeforeIt) {
  Bench bench;
  bench.run_ms(50);
  ASSERT_TRUE(bench.take_lease());
  ASSERT_EQ(bench.upload_voltage(1), CommandResult::kDone);
  bench.dyno_beats(heartbeat_t::TRIPPED);
  bench.run_ms(50);
  EXPECT_EQ(bench.core->state(), StopState::kIdle);
  EXPECT_EQ(bench.act(bridge_cmd_t::START, 1), CommandResult::kTripped);
  EXPECT_EQ(bench.core->cause(), Trip::kPeerTripped);
  bench.run_ms(50);
  EXPECT_FALSE(bench.gates_on());
  EXPECT_EQ(bench.act(bridge_cmd_t::RESET), CommandResult::kDone);
  bench.dyno_beats(heartbeat_t::OK);
  bench.start_motor(2);
}

// ---- credits

TEST(BridgeCore, DeviceThatCanWaitNeverOutrunsTheSlowestFollower) {
  Bench bench(Bench::default_rig(), true);
  const std::int64_t window = bench.rig.bridge.credit_blocks * 256;
  bench.run_ms(50);
  std::int64_t fast = 0, slow = 0;
  std::int64_t furthest = 0;
  for (int k = 0; k < 2000; ++k) {
    fast = bench.samples.empty() ? 0 : bench.samples.back().first_index + bench.samples.back().n;
    if (k == 0) slow = fast;
    if (k % 3 == 0) slow = std::min(slow + 64, fast);
    bench.ack(heartbeat_t::RECORDER, fast);
    bench.ack(heartbeat_t::ESTIMATOR, slow);
    bench.run_ms(1);
    furthest = std::max(furthest, bench.device.next_index - slow);
    if (k > 50) {
      ASSERT_LE(bench.device.next_index, slow + window + 64) << k;
    }
  }
  EXPECT_GT(furthest, window / 2) << "the window is used";
  EXPECT_GT(slow, 40'000) << "and the device goes on";
  expect_contiguous(bench.samples);
  EXPECT_EQ(bench.status().link_state, bridge_status_t::LINK_UP);
}

TEST(BridgeCore, FollowerThatDiesHoldsTheDeviceForASecondOnly) {
  Bench bench(Bench::default_rig(), true);
  bench.run_ms(50);
  bench.ack(heartbeat_t::RECORDER, bench.device.next_index);
  bench.run_ms(500);
  const std::int64_t held = bench.device.next_index;
  bench.run_ms(300);
  EXPECT_EQ(bench.device.next_index, held);
  EXPECT_EQ(bench.status().link_state, bridge_status_t::LINK_UP) << "a waiting device is not a silent one";
  bench.run_ms(400);
  EXPECT_GT(bench.device.next_index, held + 10'000);
}

TEST(BridgeCore, AcksOfAnOldLogHoldNothingUp) {
  Bench bench(Bench::default_rig(), true);
  bench.run_ms(50);
  for (int k = 0; k < 100; ++k) {
    imrig_msg::ack_t old = {};
    old.boot_id = 3;
    old.process = heartbeat_t::RECORDER;
    bench.core->on_ack(old, bench.now);
    bench.run_ms(1);
  }
  EXPECT_GT(bench.device.next_index, 100'000);
}

// ---- the end of the process

TEST(BridgeCore, ShuttingDownRampsTheMotorDownAndOpensTheGates) {
  Bench bench;
  bench.start_motor();
  bench.core->shut_down(bench.now);
  EXPECT_EQ(bench.core->state(), StopState::kStopping);
  EXPECT_EQ(bench.act(bridge_cmd_t::RESET), CommandResult::kBusy);
  ASSERT_TRUE(bench.run_until([&] { return bench.core->finished(bench.now); }, 3000));
  EXPECT_FALSE(bench.gates_on());
  EXPECT_EQ(bench.device.state, IMRIG_IDLE);
  EXPECT_EQ(bench.core->cause(), Trip::kNone);
  EXPECT_EQ(bench.heartbeats.back().state, heartbeat_t::STOPPING);
}

TEST(BridgeCore, ShuttingDownAnIdleRigIsQuick) {
  Bench bench;
  bench.run_ms(100);
  bench.core->shut_down(bench.now);
  EXPECT_TRUE(bench.core->finished(bench.now));
}

TEST(BridgeCore, ShuttingDownIsBoundedWhateverTheDeviceDoes) {
  Bench bench;
  bench.start_motor();
  bench.device_speed = 0;  // it answers, but its time stands still
  bench.core->shut_down(bench.now);
  ASSERT_TRUE(bench.run_until([&] { return bench.core->finished(bench.now); }, 3001));
  EXPECT_FALSE(bench.gates_on()) << "what did not ramp down in time was opened at once";
}

TEST(BridgeCore, ShuttingDownWithADeadLinkEndsAtItsBound) {
  Bench bench;
  bench.start_motor();
  bench.wire_up = false;
  bench.core->shut_down(bench.now);
  EXPECT_TRUE(bench.run_until([&] { return bench.core->finished(bench.now); }, 3001));
  EXPECT_FALSE(bench.gates_on()) << "the device's own watchdog";
}

// ---- whatever happens

struct Monkey {
  explicit Monkey(unsigned seed) : random(seed) {}
  std::mt19937_64 random;
  Bench bench;
  std::int32_t id = 1;

  int dice(int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); }

  void command(std::int32_t action, std::int32_t profile_id) {
    bridge_cmd_t cmd = {};
    cmd.bridge_cmd_v1 = 1;
    cmd.action = action;
    cmd.profile_id = profile_id;
    cmd.at_end = dice(2);
    cmd.n_segments = 1;
    cmd.segments[0].kind = 1;
    cmd.segments[0].duration_samples = 1 + dice(2000);
    cmd.segments[0].amplitude_start_V = cmd.segments[0].amplitude_end_V = dice(220);
    bench.client.sign(cmd, bench.now);
    if (dice(10) == 0) cmd.seq -= 1;
    bench.core->on_bridge_cmd(cmd, bench.now);
  }

  void act() {
    switch (dice(16)) {
      case 0:
        bench.estop();
        break;
      case 1:
        bench.client.acquire();
        break;
      case 2:
        if (dice(8) == 0) bench.client.release();
        break;
      case 3:
      case 4:
        command(bridge_cmd_t::UPLOAD, ++id);
        break;
      case 5:
      case 6:
      case 7:
        command(bridge_cmd_t::START, id);
        break;
      case 8:
        command(bridge_cmd_t::STOP, 0);
        break;
      case 9:
      case 10:
        command(bridge_cmd_t::RESET, 0);
        break;
      case 11:
        bench.wire_up = dice(4) != 0;
        break;
      case 12:
        if (dice(20) == 0) bench.reboot_device();
        break;
      case 13:
        bench.counts.stator_C = dice(4) == 0 ? 150.0f : 20.0f;
        break;
      case 14:
        bench.dyno_beats(dice(4) == 0 ? +heartbeat_t::TRIPPED : +heartbeat_t::OK);
        break;
      default:
        bench.loses = dice(3) != 0 ? nullptr : decltype(bench.loses)([this](auto) { return dice(4) == 0; });
        break;
    }
  }
};

TEST(BridgeCore, NoSequenceOfEventsLeavesTheGatesOnInATrippedState) {
  int trips = 0, resets = 0, driven = 0;
  for (unsigned seed = 1; seed <= 200; ++seed) {
    Monkey monkey(seed);
    Bench& bench = monkey.bench;
    int tripped_ms = 0, idle_ms = 0, good_ms = 0;
    StopState before = bench.core->state();
    for (int k = 0; k < 4000; ++k) {
      if (monkey.dice(5) == 0) monkey.act();
      bench.run_ms(1);
      const StopState state = bench.core->state();
      driven += bench.gates_on() ? 1 : 0;
      trips += before != state && state == StopState::kTripped ? 1 : 0;
      resets += before == StopState::kTripped && state != before ? 1 : 0;
      if (before == StopState::kTripped && state != before) {
        ASSERT_EQ(state, StopState::kIdle) << "seed " << seed << " step " << k;
      }
      tripped_ms = state == StopState::kTripped ? tripped_ms + 1 : 0;
      idle_ms = state == StopState::kIdle ? idle_ms + 1 : 0;
      before = state;
      // on a wire that works the order is carried out at once, after a fault with the link's next repeat (50
      // ms); on a dead wire the device's watchdog does it
      good_ms = bench.wire_up && !bench.loses ? good_ms + 1 : 0;
      const bool link_up = bench.status().link_state == bridge_status_t::LINK_UP;
      const bool ordered = link_up && tripped_ms > 2 && (good_ms >= tripped_ms || good_ms > 60);
      if (ordered || tripped_ms > bench.rig.limits.device_watchdog_ms + 20) {
        ASSERT_FALSE(bench.gates_on())
            << "tripped, seed " << seed << " step " << k << " tripped_ms " << tripped_ms << " good_ms "
            << good_ms << " cause " << static_cast<int>(bench.core->cause()) << " device "
            << bench.device.state;
      }
      if (idle_ms > bench.rig.limits.device_watchdog_ms + 20) {
        ASSERT_FALSE(bench.gates_on()) << "idle, seed " << seed << " step " << k;
      }
    }
  }
  EXPECT_GT(trips, 50);
  EXPECT_GT(resets, 20);
  EXPECT_GT(driven, 1000);
}

}  // namespace
}  // namespace imrig
