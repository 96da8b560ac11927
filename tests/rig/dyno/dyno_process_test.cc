// The real process on a real bus, with a real Modbus server behind it.

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <imrig_msg/dyno_cmd_t.hpp>
#include <imrig_msg/dyno_status_t.hpp>
#include <imrig_msg/estop_cmd_t.hpp>
#include <imrig_msg/heartbeat_t.hpp>
#include <memory>
#include <optional>

#include "plant/modbus_server.h"
#include "rig/base/clock.h"
#include "rig/base/file.h"
#include "rig/bus/channels.h"
#include "rig/safety/command_result.h"
#include "rig/safety/lease_client.h"
#include "rig/safety/trip.h"
#include "tests/e2e/command.h"
#include "tests/rig/bus/wire.h"

namespace imrig {
namespace {

using imrig_msg::dyno_cmd_t;
using imrig_msg::dyno_status_t;
using imrig_msg::heartbeat_t;
using plant::ModbusServer;

// imrig-dyno with its configuration, and a commander at the same bus.
class DynoProcess : public testing::Test {
 protected:
  DynoProcess() { config_.bus = test::bus_config(test::free_udp_port()); }

  void start(const std::string& link) {
    config_.dyno.link = link;
    write_text_atomically(folder_ / "rig.toml", to_toml(config_));
    bus_ = open_lcm_bus(config_.bus);
    subscribe<dyno_status_t>(*bus_, channel::kDynoStatus, [this](const auto& m) { status_ = m; });
    subscribe<imrig_msg::lease_t>(*bus_, channel::kDynoLease,
                                  [this](const auto& m) { lease_.on_lease(m, now()); });
    subscribe<heartbeat_t>(*bus_, channel::kHeartbeat, [this](const auto& m) { on_heartbeat(m); });
    process_ = std::make_unique<test::Background>(
        std::vector<std::string>{"imrig-dyno", "--config", folder_ / "rig.toml"}, folder_ / "out");
    ASSERT_TRUE(until([this] { return heartbeat_.has_value() && status_.seq > 0; })) << said();
  }

  static Moment now() { return {monotonic_us(), wall_us()}; }

  void on_heartbeat(const heartbeat_t& beat) {
    if (beat.process != heartbeat_t::DYNO) return;
    if (heartbeat_)
      longest_silence_us_ = std::max(longest_silence_us_, beat.host_utime - heartbeat_->host_utime);
    heartbeat_ = beat;
  }

  bool until(const std::function<bool()>& reached, int timeout_s = 60) {
    return test::wait_until(
        *bus_,
        [&] {
          if (const auto request = lease_.step(now())) publish(*bus_, channel::kLeaseCmd, *request);
          return reached();
        },
        timeout_s);
  }
  bool take_lease() {
    lease_.acquire();
    return until([this] { return lease_.held(); });
  }
  CommandResult send(dyno_cmd_t cmd) {
    cmd.dyno_cmd_v1 = 1;
    lease_.sign(cmd, now());
    last_cmd_ = cmd;
    publish(*bus_, channel::kDynoCmd, cmd);
    EXPECT_TRUE(
        until([&] { return status_.last_cmd_epoch == cmd.lease_epoch && status_.last_cmd_seq == cmd.seq; }));
    return static_cast<CommandResult>(status_.last_cmd_result);
  }
  CommandResult set(std::int32_t mode, double value) {
    dyno_cmd_t cmd = {};
    cmd.action = dyno_cmd_t::SET;
    cmd.mode = mode;
    cmd.value = value;
    cmd.ramp_per_s = std::nan("");
    return send(cmd);
  }
  std::string said() { return read_text(folder_ / "out"); }

  test::Folder folder_;
  RigConfig config_;
  std::unique_ptr<Bus> bus_;
  std::unique_ptr<test::Background> process_;
  LeaseClient lease_{heartbeat_t::DYNO, random_id(), 2'000'000};
  dyno_status_t status_ = {};
  dyno_cmd_t last_cmd_ = {};
  std::optional<heartbeat_t> heartbeat_;
  std::int64_t longest_silence_us_ = 0;
};

TEST_F(DynoProcess, SetsTheSupplyReadsItBackAndSwitchesItOffAtTheEnd) {
  ModbusServer supply("tcp://127.0.0.1:0");
  start(supply.bound_url());
  ASSERT_TRUE(take_lease());
  ASSERT_TRUE(until([&] { return status_.link_state == dyno_status_t::LINK_UP; }));
  EXPECT_GT(heartbeat_->pid, 0);
  ASSERT_EQ(set(dyno_cmd_t::VOLTAGE, 24.0), CommandResult::kDone);
  ASSERT_TRUE(until([&] { return status_.at_target == 1; }));
  EXPECT_DOUBLE_EQ(supply.command().set_V, 24.0);
  EXPECT_TRUE(supply.command().output_on);
  EXPECT_DOUBLE_EQ(status_.setpoint_V, 24.0);
  EXPECT_EQ(status_.run_state, dyno_status_t::ON);
  supply.set_readback({.V = 23.98, .A = 1.199, .output_on = true});
  EXPECT_TRUE(until([&] { return status_.readback_V == 23.98 && status_.readback_A == 1.199; }));
  EXPECT_EQ(set(dyno_cmd_t::VOLTAGE, 61.0), CommandResult::kOverLimit);
  EXPECT_EQ(process_->stop(), 0) << said();
  EXPECT_FALSE(supply.command().output_on);
  EXPECT_EQ(supply.command().set_V, 0.0);
  EXPECT_NE(said().find("ready\n"), std::string::npos);
}

TEST_F(DynoProcess, RunsWithoutASupplyAndFindsItWhenItComes) {
  const int port = test::free_tcp_port();
  const std::string url = "tcp://127.0.0.1:" + std::to_string(port);
  start(url);
  ASSERT_TRUE(take_lease());
  EXPECT_EQ(status_.link_state, dyno_status_t::LINK_ABSENT);
  EXPECT_EQ(heartbeat_->state, heartbeat_t::DEGRADED);
  EXPECT_EQ(set(dyno_cmd_t::VOLTAGE, 5.0), CommandResult::kLinkAbsent);
  const ModbusServer supply(url);
  EXPECT_TRUE(until(
      [&] { return status_.link_state == dyno_status_t::LINK_UP && heartbeat_->state == heartbeat_t::OK; }));
  EXPECT_EQ(set(dyno_cmd_t::VOLTAGE, 5.0), CommandResult::kDone);
  EXPECT_TRUE(until([&] { return supply.command().set_V == 5.0; }));
}

TEST_F(DynoProcess, ASupplyThatDiesWhileOnIsATripAndTheHeartbeatsGoOn) {
  auto supply = std::make_unique<ModbusServer>("tcp://127.0.0.1:0");
  const std::string url = supply->bound_url();
  start(url);
  ASSERT_TRUE(take_lease());
  ASSERT_TRUE(until([&] { return status_.link_state == dyno_status_t::LINK_UP; }));
  ASSERT_EQ(set(dyno_cmd_t::FIELD_CURRENT, 1.5), CommandResult::kDone);
  ASSERT_TRUE(until([&] { return status_.at_target == 1; }));
  longest_silence_us_ = 0;
  supply.reset();
  ASSERT_TRUE(until([&] { return status_.run_state == dyno_status_t::TRIPPED; }));
  EXPECT_EQ(status_.trip, static_cast<std::int32_t>(Trip::kSupplySilent));
  EXPECT_EQ(status_.link_state, dyno_status_t::LINK_SILENT);
  EXPECT_TRUE(until([&] { return heartbeat_->state == heartbeat_t::TRIPPED; }));
  EXPECT_EQ(heartbeat_->state_code, static_cast<std::int32_t>(Trip::kSupplySilent));
  EXPECT_LT(longest_silence_us_, 2'000'000);  // what makes a peer silent
  dyno_cmd_t reset = {};
  reset.action = dyno_cmd_t::RESET;
  EXPECT_EQ(send(reset), CommandResult::kLinkAbsent);
  supply = std::make_unique<ModbusServer>(url);
  ASSERT_TRUE(until([&] { return status_.link_state == dyno_status_t::LINK_UP && status_.at_target == 1; }));
  EXPECT_EQ(send(reset), CommandResult::kDone);
  EXPECT_EQ(set(dyno_cmd_t::FIELD_CURRENT, 0.5), CommandResult::kDone);
  EXPECT_TRUE(until([&] { return supply->command().set_A == 0.5 && supply->command().output_on; }));
}

TEST_F(DynoProcess, AReplayedCommandMovesNothing) {
  const ModbusServer supply("tcp://127.0.0.1:0");
  start(supply.bound_url());
  ASSERT_TRUE(take_lease());
  ASSERT_TRUE(until([&] { return status_.link_state == dyno_status_t::LINK_UP; }));
  ASSERT_EQ(set(dyno_cmd_t::VOLTAGE, 10.0), CommandResult::kDone);
  const dyno_cmd_t recorded = last_cmd_;
  dyno_cmd_t off = {};
  off.action = dyno_cmd_t::OFF;
  ASSERT_EQ(send(off), CommandResult::kDone);
  ASSERT_TRUE(until([&] { return !supply.command().output_on && status_.at_target == 1; }));
  publish(*bus_, channel::kDynoCmd, recorded);
  ASSERT_TRUE(until([&] { return status_.last_cmd_seq == recorded.seq; }));
  EXPECT_EQ(static_cast<CommandResult>(status_.last_cmd_result), CommandResult::kNotNew);
  lease_.release();
  ASSERT_TRUE(until([&] { return !lease_.held(); }));
  publish(*bus_, channel::kDynoCmd, recorded);
  ASSERT_TRUE(
      until([&] { return static_cast<CommandResult>(status_.last_cmd_result) == CommandResult::kNoLease; }));
  EXPECT_EQ(status_.run_state, dyno_status_t::OFF);
  EXPECT_FALSE(supply.command().output_on);
}

TEST_F(DynoProcess, TheEmergencyStopNeedsNoLease) {
  const ModbusServer supply("tcp://127.0.0.1:0");
  start(supply.bound_url());
  ASSERT_TRUE(take_lease());
  ASSERT_TRUE(until([&] { return status_.link_state == dyno_status_t::LINK_UP; }));
  ASSERT_EQ(set(dyno_cmd_t::VOLTAGE, 30.0), CommandResult::kDone);
  ASSERT_TRUE(until([&] { return status_.at_target == 1; }));
  imrig_msg::estop_cmd_t stop = {};
  stop.estop_cmd_v1 = 1;
  stop.issued_host_utime = wall_us();
  stop.ttl_ms = 5000;
  publish(*bus_, channel::kEstopCmd, stop);
  ASSERT_TRUE(until([&] { return status_.trip == static_cast<std::int32_t>(Trip::kOperatorStop); }));
  EXPECT_TRUE(until([&] { return !supply.command().output_on && supply.command().set_V == 0.0; }));
}

TEST_F(DynoProcess, BadConfigurationIsOneSentenceAndExitCodeTwo) {
  const auto refuses = [this](const std::string& dyno_lines, const std::string& named) {
    write_text_atomically(folder_ / "bad.toml",
                          "version = 1\n[bus]\nurl = \"" + config_.bus.url + "\"\n[dyno]\n" + dyno_lines);
    const test::Outcome out = test::run({"imrig-dyno", "--config", folder_ / "bad.toml"}, 60);
    EXPECT_EQ(out.exit_code, 2) << dyno_lines;
    EXPECT_NE(out.err.find(named), std::string::npos) << out.err;
    EXPECT_EQ(std::count(out.err.begin(), out.err.end(), '\n'), 1) << out.err;
    EXPECT_EQ(out.out, "");
  };
  refuses("link = \"tcp:/127.0.0.1:1\"\n", "tcp:/127.0.0.1:1");
  refuses("link = \"tcp://127.0.0.1:0\"\n", "tcp://127.0.0.1:0");
  refuses("link = \"rtu:///dev/no_such_device\"\n", "no_such_device");
  refuses("register_map = \"no_such_map\"\n", "no_such_map");
  refuses("colour = 3\n", "colour");
  EXPECT_EQ(test::run({"imrig-dyno", "--config", folder_ / "none.toml"}, 60).exit_code, 2);
  EXPECT_EQ(test::run({"imrig-dyno", "--nonsense"}, 60).exit_code, 2);
}

}  // namespace
}  // namespace imrig
