#include "rig/dyno/dyno_core.h"

#include <gtest/gtest.h>

#include <cmath>

#include "rig/base/generator.h"
#include "rig/base/space_vector.h"
#include "rig/dyno/excitation_model.h"
#include "tests/rig/dyno/core_bench.h"

namespace imrig {
namespace {

using imrig_msg::dyno_cmd_t;
using imrig_msg::dyno_status_t;
using imrig_msg::heartbeat_t;

constexpr double kDefaultRamp = std::numeric_limits<double>::quiet_NaN();

TEST(DynoCore, ItStartsOffAndAtTargetOnceTheSupplySaysSo) {
  CoreBench bench;
  EXPECT_TRUE(bench.is_off());
  const dyno_status_t status = bench.core.status(bench.now);
  EXPECT_EQ(status.run_state, dyno_status_t::OFF);
  EXPECT_EQ(status.link_state, dyno_status_t::LINK_UP);
  EXPECT_EQ(status.at_target, 1);
  EXPECT_EQ(bench.core.heartbeat_state(), heartbeat_t::OK);
}

TEST(DynoCore, AVoltageRampsAtTheGivenRateAndIsAtTargetWhenReadBack) {
  CoreBench bench;
  ASSERT_EQ(bench.set(dyno_cmd_t::VOLTAGE, 20.0, 40.0), CommandResult::kDone);
  bench.run_s(0.25);
  EXPECT_NEAR(bench.order.set_V, 10.0, 0.3);
  EXPECT_EQ(bench.order.set_A, DynoConfig().max_A);
  EXPECT_TRUE(bench.order.output_on);
  EXPECT_EQ(bench.core.status(bench.now).at_target, 0);
  double last_V = bench.order.set_V;
  for (int k = 0; k < 60; ++k) {
    bench.run_s(0.005);
    EXPECT_LE(bench.order.set_V - last_V, 40.0 * 0.005 + 1e-9);
    last_V = bench.order.set_V;
  }
  EXPECT_EQ(bench.order.set_V, 20.0);
  const dyno_status_t status = bench.core.status(bench.now);
  EXPECT_EQ(status.at_target, 1);
  EXPECT_EQ(status.run_state, dyno_status_t::ON);
  EXPECT_EQ(status.setpoint_V, 20.0);
  EXPECT_EQ(status.readback_V, 20.0);
}

TEST(DynoCore, WithoutARateTheConfigurationsLimitHoldsUpwardsAndDownwards) {
  CoreBench bench;
  ASSERT_EQ(bench.set(dyno_cmd_t::FIELD_CURRENT, 2.0), CommandResult::kDone);
  bench.run_s(0.1);
  EXPECT_NEAR(bench.order.set_A, 1.0, 0.06);  // 10 A/s
  EXPECT_EQ(bench.order.set_V, DynoConfig().max_V);
  bench.run_s(0.2);
  EXPECT_EQ(bench.order.set_A, 2.0);
  ASSERT_EQ(bench.set(dyno_cmd_t::FIELD_CURRENT, 0.5), CommandResult::kDone);
  bench.run_s(0.05);
  EXPECT_NEAR(bench.order.set_A, 1.5, 0.06);
  bench.run_s(0.2);
  EXPECT_EQ(bench.order.set_A, 0.5);
}

TEST(DynoCore, ChangingTheModeStartsWhereTheSupplyIs) {
  CoreBench bench;
  ASSERT_EQ(bench.set(dyno_cmd_t::VOLTAGE, 30.0), CommandResult::kDone);
  bench.run_s(0.5);
  ASSERT_NEAR(bench.supply.out_A, 1.5, 1e-9);
  ASSERT_EQ(bench.set(dyno_cmd_t::FIELD_CURRENT, 2.0, 1.0), CommandResult::kDone);
  bench.run_s(0.005);
  EXPECT_NEAR(bench.order.set_A, 1.5, 0.011);
  bench.run_s(0.7);
  EXPECT_EQ(bench.order.set_A, 2.0);
}

TEST(DynoCore, RampsRunInRigTimeOnceTheRigHasOne) {
  CoreBench bench;
  bench.samples_flow = true;
  bench.rig_speed = 10;
  bench.run_s(0.1);
  ASSERT_EQ(bench.set(dyno_cmd_t::VOLTAGE, 20.0, 10.0), CommandResult::kDone);
  bench.run_s(0.1);  // one second of the rig
  EXPECT_NEAR(bench.order.set_V, 10.0, 0.6);
  bench.samples_flow = false;  // the rig's clock stands still
  const double stopped_V = bench.order.set_V;
  bench.run_s(1.0);
  EXPECT_EQ(bench.order.set_V, stopped_V);
  EXPECT_EQ(bench.core.status(bench.now).utime, bench.core.rig_utime());
  EXPECT_GT(bench.core.rig_utime(), 1'900'000);
}

TEST(DynoCore, AShaftTorqueBecomesTheFieldCurrentThatGivesItAtTheMeasuredSpeed) {
  CoreBench bench;
  bench.samples_flow = true;
  bench.run_s(0.2);
  ASSERT_EQ(bench.set(dyno_cmd_t::SHAFT_TORQUE, 8.0), CommandResult::kDone);
  bench.run_s(1.0);
  const GeneratorConfig generator;
  EXPECT_NEAR(shaft_torque_Nm(generator, rad_s_of_rpm(1500.0), bench.order.set_A), 8.0, 0.05);
  EXPECT_EQ(bench.order.set_V, DynoConfig().max_V);
  EXPECT_EQ(bench.core.status(bench.now).at_target, 1);
  bench.rpm = 900.0;
  bench.run_s(1.0);
  EXPECT_NEAR(shaft_torque_Nm(generator, rad_s_of_rpm(900.0), bench.order.set_A), 8.0, 0.05);
  EXPECT_EQ(bench.core.status(bench.now).at_target, 1);
}

TEST(DynoCore, ATorqueThatTheSpeedCannotCarryIsNeverAtTarget) {
  CoreBench bench;
  bench.samples_flow = true;
  bench.rpm = 30.0;
  bench.run_s(0.2);
  ASSERT_EQ(bench.set(dyno_cmd_t::SHAFT_TORQUE, 20.0), CommandResult::kDone);
  bench.run_s(2.0);
  EXPECT_NEAR(bench.order.set_A, most_field_A(GeneratorConfig(), DynoConfig()), 0.01);
  EXPECT_EQ(bench.core.status(bench.now).at_target, 0);
}

TEST(DynoCore, SmallMovesOfTheSpeedAreNotWrittenToTheSupply) {
  CoreBench bench;
  bench.samples_flow = true;
  bench.run_s(0.2);
  ASSERT_EQ(bench.set(dyno_cmd_t::SHAFT_TORQUE, 8.0), CommandResult::kDone);
  bench.run_s(2.0);
  const std::int64_t orders = bench.order.number;
  for (int k = 0; k < 20; ++k) {
    bench.rpm = 1500.0 + (k % 2 == 0 ? 1.0 : -1.0);
    bench.run_s(0.1);
  }
  EXPECT_EQ(bench.order.number, orders);
}

TEST(DynoCore, WhatIsMalformedOrOverALimitIsRefusedAndMovesNothing) {
  CoreBench bench;
  bench.samples_flow = true;
  bench.run_s(0.1);
  const auto refused = [&](std::int32_t mode, double value, double ramp) {
    const CommandResult result = bench.set(mode, value, ramp);
    bench.run_s(0.02);
    EXPECT_TRUE(bench.is_off());
    return result;
  };
  EXPECT_EQ(refused(dyno_cmd_t::VOLTAGE, 60.1, kDefaultRamp), CommandResult::kOverLimit);
  EXPECT_EQ(refused(dyno_cmd_t::FIELD_CURRENT, 5.1, kDefaultRamp), CommandResult::kOverLimit);
  EXPECT_EQ(refused(dyno_cmd_t::SHAFT_TORQUE, 1e4, kDefaultRamp), CommandResult::kOverLimit);
  EXPECT_EQ(refused(dyno_cmd_t::VOLTAGE, 10.0, 101.0), CommandResult::kOverLimit);
  EXPECT_EQ(refused(dyno_cmd_t::VOLTAGE, 10.0, 0.0), CommandResult::kMalformed);
  EXPECT_EQ(refused(dyno_cmd_t::VOLTAGE, 10.0, -5.0), CommandResult::kMalformed);
  EXPECT_EQ(refused(dyno_cmd_t::VOLTAGE, -1.0, kDefaultRamp), CommandResult::kMalformed);
  EXPECT_EQ(refused(dyno_cmd_t::VOLTAGE, NAN, kDefaultRamp), CommandResult::kMalformed);
  EXPECT_EQ(refused(dyno_cmd_t::VOLTAGE, INFINITY, kDefaultRamp), CommandResult::kMalformed);
  EXPECT_EQ(refused(0, 1.0, kDefaultRamp), CommandResult::kMalformed);
  EXPECT_EQ(refused(4, 1.0, kDefaultRamp), CommandResult::kMalformed);
  EXPECT_EQ(bench.act(17), CommandResult::kMalformed);
}

TEST(DynoCore, TorqueNeedsASpeedAndASupplyThatCanBeSet) {
  CoreBench blind;
  EXPECT_EQ(blind.set(dyno_cmd_t::SHAFT_TORQUE, 1.0), CommandResult::kLinkAbsent);
  DynoCoreConfig reads_only;
  reads_only.can_set_A = reads_only.can_set_V = false;
  CoreBench meter(reads_only);
  EXPECT_EQ(meter.set(dyno_cmd_t::VOLTAGE, 1.0), CommandResult::kMalformed);
  EXPECT_EQ(meter.set(dyno_cmd_t::FIELD_CURRENT, 1.0), CommandResult::kMalformed);
}

TEST(DynoCore, WithoutTheLeaseOrASecondTimeOrLateNothingMoves) {
  CoreBench bench;
  dyno_cmd_t cmd = {};
  cmd.action = dyno_cmd_t::SET;
  cmd.mode = dyno_cmd_t::VOLTAGE;
  cmd.value = 10.0;
  cmd.ramp_per_s = NAN;
  cmd.seq = 1;
  cmd.issued_host_utime = bench.now.wall_us;
  cmd.ttl_ms = 1000;
  cmd.lease_epoch = 12345;
  bench.core.on_command(cmd, bench.now);
  EXPECT_EQ(bench.result(), CommandResult::kNoLease);
  bench.lease.sign(cmd, bench.now);
  cmd.issued_host_utime -= 2'000'000;
  bench.core.on_command(cmd, bench.now);
  EXPECT_EQ(bench.result(), CommandResult::kStale);
  bench.lease.sign(cmd, bench.now);
  bench.core.on_command(cmd, bench.now);
  EXPECT_EQ(bench.result(), CommandResult::kDone);
  bench.core.on_command(cmd, bench.now);
  EXPECT_EQ(bench.result(), CommandResult::kNotNew);
  ASSERT_EQ(bench.act(dyno_cmd_t::OFF), CommandResult::kDone);
  bench.run_s(0.02);
  EXPECT_TRUE(bench.is_off());
}

TEST(DynoCore, OffIsAtOnceAndWithoutARamp) {
  CoreBench bench;
  ASSERT_EQ(bench.set(dyno_cmd_t::VOLTAGE, 30.0), CommandResult::kDone);
  bench.run_s(0.5);
  ASSERT_EQ(bench.act(dyno_cmd_t::OFF), CommandResult::kDone);
  bench.run_s(0.005);
  EXPECT_TRUE(bench.is_off());
  bench.run_s(0.02);
  EXPECT_EQ(bench.core.status(bench.now).run_state, dyno_status_t::OFF);
  EXPECT_EQ(bench.core.status(bench.now).at_target, 1);
}

// One bench that is on at 20 V, something that goes wrong, and the trip that must follow.
struct Fault {
  const char* name;
  Trip trip;
  void (*happens)(CoreBench&);
  double within_s;
};

class DynoTrip : public testing::TestWithParam<Fault> {};

TEST_P(DynoTrip, TakesTheExcitationAwayAndStaysUntilReset) {
  CoreBench bench;
  bench.bridge_beats = true;
  bench.run_s(0.1);
  ASSERT_EQ(bench.set(dyno_cmd_t::VOLTAGE, 20.0), CommandResult::kDone);
  bench.run_s(1.0);
  ASSERT_EQ(bench.core.trip(), Trip::kNone);
  ASSERT_EQ(bench.order.set_V, 20.0);
  GetParam().happens(bench);
  bench.run_s(GetParam().within_s);
  EXPECT_EQ(bench.core.trip(), GetParam().trip);
  EXPECT_TRUE(bench.is_off());
  EXPECT_EQ(bench.core.heartbeat_state(), heartbeat_t::TRIPPED);
  const dyno_status_t status = bench.core.status(bench.now);
  EXPECT_EQ(status.run_state, dyno_status_t::TRIPPED);
  EXPECT_EQ(status.trip, static_cast<std::int32_t>(GetParam().trip));
  // A second cause does not replace the first, and nothing but a reset helps.
  bench.estop();
  EXPECT_EQ(bench.core.trip(), GetParam().trip);
  bench.commander_alive = bench.supply_answers = bench.bridge_beats = true;
  bench.bridge_state = heartbeat_t::OK;
  bench.supply.mismatch = bench.supply.wrong_device = false;
  bench.lease.acquire();
  bench.run_s(0.5);
  EXPECT_EQ(bench.set(dyno_cmd_t::VOLTAGE, 10.0), CommandResult::kTripped);
  bench.run_s(0.1);
  EXPECT_TRUE(bench.is_off());
  EXPECT_EQ(bench.act(dyno_cmd_t::RESET), CommandResult::kDone);
  bench.supply.protection = 0;  // goes with the next switching on
  EXPECT_EQ(bench.set(dyno_cmd_t::VOLTAGE, 10.0), CommandResult::kDone);
  bench.run_s(0.5);
  EXPECT_EQ(bench.order.set_V, 10.0);
  EXPECT_EQ(bench.core.trip(), Trip::kNone);
}

INSTANTIATE_TEST_SUITE_P(
    All, DynoTrip,
    testing::Values(
        Fault{"EmergencyStop", Trip::kOperatorStop, [](CoreBench& b) { b.estop(); }, 0.005},
        Fault{"LeaseRunsOut", Trip::kLeaseLost, [](CoreBench& b) { b.commander_alive = false; }, 2.1},
        Fault{"LeaseReleased", Trip::kLeaseLost, [](CoreBench& b) { b.lease.release(); }, 0.1},
        Fault{"SupplySilent", Trip::kSupplySilent, [](CoreBench& b) { b.supply_answers = false; }, 1.2},
        Fault{"SupplyProtection", Trip::kSupplyProtection, [](CoreBench& b) { b.supply.protection = 2; },
              0.02},
        Fault{"RegistersDiffer", Trip::kSupplyMismatch, [](CoreBench& b) { b.supply.mismatch = true; }, 0.02},
        Fault{"AnotherDevice", Trip::kSupplyMismatch, [](CoreBench& b) { b.supply.wrong_device = true; },
              0.02},
        Fault{"BridgeTripped", Trip::kPeerTripped,
              [](CoreBench& b) { b.bridge_state = heartbeat_t::TRIPPED; }, 0.02},
        Fault{"BridgeSilent", Trip::kPeerSilent, [](CoreBench& b) { b.bridge_beats = false; }, 2.1},
        Fault{"BridgeSaysGoodbye", Trip::kPeerSilent,
              [](CoreBench& b) { b.bridge_state = heartbeat_t::STOPPING; }, 0.02}),
    [](const testing::TestParamInfo<Fault>& fault) { return fault.param.name; });

TEST(DynoCore, AShortSilenceOfTheSupplyIsSurvived) {
  CoreBench bench;
  ASSERT_EQ(bench.set(dyno_cmd_t::VOLTAGE, 20.0), CommandResult::kDone);
  bench.run_s(0.5);
  bench.supply_answers = false;
  bench.run_s(0.9);  // limit: 500 ms and two time-outs of 300 ms
  bench.supply_answers = true;
  bench.run_s(0.2);
  EXPECT_EQ(bench.core.trip(), Trip::kNone);
  EXPECT_EQ(bench.order.set_V, 20.0);
}

TEST(DynoCore, WhileOffOnlyTheEmergencyStopTrips) {
  CoreBench bench;
  bench.bridge_beats = true;
  bench.bridge_state = heartbeat_t::TRIPPED;
  bench.supply.mismatch = true;
  bench.supply.protection = 1;
  bench.run_s(0.5);
  bench.supply_answers = bench.commander_alive = false;
  bench.run_s(5.0);
  EXPECT_EQ(bench.core.trip(), Trip::kNone);
  bench.estop(5'000'000);  // an old one, from a replayed log
  EXPECT_EQ(bench.core.trip(), Trip::kNone);
  bench.estop();
  EXPECT_EQ(bench.core.trip(), Trip::kOperatorStop);
}

TEST(DynoCore, AnAbsentSupplyRefusesSetPointsAndDegradesTheHeartbeat) {
  CoreBench bench;
  bench.supply_answers = false;
  bench.supply.link = SupplyLink::kAbsent;
  bench.run_s(0.1);
  EXPECT_EQ(bench.set(dyno_cmd_t::VOLTAGE, 10.0), CommandResult::kLinkAbsent);
  EXPECT_EQ(bench.core.heartbeat_state(), heartbeat_t::DEGRADED);
  EXPECT_EQ(bench.core.status(bench.now).link_state, dyno_status_t::LINK_ABSENT);
  bench.estop();
  EXPECT_EQ(bench.act(dyno_cmd_t::RESET), CommandResult::kLinkAbsent);
}

TEST(DynoCore, ResetWaitsUntilTheSupplyIsKnownToBeOff) {
  CoreBench bench;
  ASSERT_EQ(bench.set(dyno_cmd_t::VOLTAGE, 20.0), CommandResult::kDone);
  bench.run_s(0.5);
  bench.estop();
  EXPECT_EQ(bench.act(dyno_cmd_t::RESET), CommandResult::kBusy);
  bench.run_s(0.1);
  EXPECT_EQ(bench.act(dyno_cmd_t::RESET), CommandResult::kDone);
}

TEST(DynoCore, AProtectionTripOfLastTimeDoesNotTripTheNextOne) {
  CoreBench bench;
  ASSERT_EQ(bench.set(dyno_cmd_t::VOLTAGE, 20.0), CommandResult::kDone);
  bench.run_s(0.5);
  bench.supply.protection = 1;
  bench.run_s(0.05);
  ASSERT_EQ(bench.core.trip(), Trip::kSupplyProtection);
  ASSERT_EQ(bench.act(dyno_cmd_t::RESET), CommandResult::kDone);
  bench.run_s(0.05);
  ASSERT_EQ(bench.set(dyno_cmd_t::VOLTAGE, 20.0), CommandResult::kDone);
  bench.core.on_supply(bench.supply, bench.now);  // still of before
  EXPECT_EQ(bench.core.trip(), Trip::kNone);
  bench.supply.protection = 0;
  bench.run_s(0.5);
  EXPECT_EQ(bench.core.trip(), Trip::kNone);
}

TEST(DynoCore, StoppingSwitchesOffAndTakesNothingMore) {
  CoreBench bench;
  ASSERT_EQ(bench.set(dyno_cmd_t::VOLTAGE, 20.0), CommandResult::kDone);
  bench.run_s(0.5);
  bench.core.stop();
  EXPECT_FALSE(bench.core.supply_is_off());
  EXPECT_EQ(bench.set(dyno_cmd_t::VOLTAGE, 20.0), CommandResult::kBusy);
  bench.run_s(0.05);
  EXPECT_TRUE(bench.is_off());
  EXPECT_TRUE(bench.core.supply_is_off());
}

}  // namespace
}  // namespace imrig
