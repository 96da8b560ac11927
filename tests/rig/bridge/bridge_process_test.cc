// The process imrig-bridge on real LCM and a real UDP link, with the device core that firmware runs at the
// other end.

#include <gtest/gtest.h>
#include <signal.h>
#include <stdlib.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <imrig_msg/ack_t.hpp>
#include <imrig_msg/samples_t.hpp>

#include "rig/base/clock.h"
#include "rig/bus/channels.h"
#include "rig/safety/trip.h"
#include "tests/rig/bridge/commander.h"
#include "tests/rig/bridge/device_partner.h"
#include "tests/rig/bridge/process.h"

namespace imrig {
namespace {

using imrig_msg::bridge_cmd_t;
using imrig_msg::bridge_status_t;
using imrig_msg::heartbeat_t;
using imrig_msg::samples_t;

// A folder with a rig.toml, removed at the end.
class RigFile {
 public:
  explicit RigFile(const std::string& text) {
    std::string pattern = (std::filesystem::temp_directory_path() / "imrig-bridge-XXXXXX").string();
    folder_ = ::mkdtemp(pattern.data());
    std::ofstream(path()) << text;
  }
  ~RigFile() { std::filesystem::remove_all(folder_); }
  RigFile(const RigFile&) = delete;
  RigFile& operator=(const RigFile&) = delete;
  std::string path() const { return folder_ + "/rig.toml"; }

 private:
  std::string folder_;
};

struct Rig {
  explicit Rig(bool at_max_pace = false, std::function<void(RigConfig&)> change = {})
      : device(at_max_pace),
        config(test_rig(device.url())),
        file((change ? change(config) : void(), to_toml(config))),
        commander(config) {
    EXPECT_EQ(bridge.first_line(), "ready");
  }
  bool gates_open_within(int ms) {
    return commander.until([this] { return !device.gates_on; }, ms);
  }

  DevicePartner device;
  RigConfig config;
  RigFile file;
  Commander commander;
  Process bridge{{"imrig-bridge", "--config", file.path()}};
};

TEST(BridgeProcess, SamplesArriveWithoutLossAndSoon) {
  Rig rig;
  std::vector<std::int64_t> latencies_us;
  std::int64_t next_seq = -1, next_index = -1, gaps = 0;
  subscribe<samples_t>(*rig.commander.bus, channel::kSamples, [&](const samples_t& s) {
    if (next_seq >= 0 && (s.seq != next_seq || s.first_index != next_index)) ++gaps;
    next_seq = s.seq + 1;
    next_index = s.first_index + s.n;
    if (const std::int64_t sent_us = rig.device.sent_us(s.first_index))
      latencies_us.push_back(monotonic_us() - sent_us);
  });
  ASSERT_TRUE(rig.commander.until([&] { return next_index > 50'000; }));
  EXPECT_EQ(gaps, 0);
  ASSERT_TRUE(rig.commander.status().has_value());
  EXPECT_EQ(rig.commander.status()->lost_blocks, 0);
  EXPECT_EQ(rig.commander.status()->bad_frames, 0);
  std::sort(latencies_us.begin(), latencies_us.end());
  ASSERT_GT(latencies_us.size(), 50u);
  std::printf("block latency, device to subscriber: median %lld us, 99 %% %lld us\n",
              static_cast<long long>(latencies_us[latencies_us.size() / 2]),
              static_cast<long long>(latencies_us[latencies_us.size() * 99 / 100]));
  EXPECT_LT(latencies_us[latencies_us.size() / 2], 20'000);
}

TEST(BridgeProcess, DeviceAtFullPaceLosesNothingToAFollowerThatAcknowledges) {
  Rig rig(true);
  Bus& bus = *rig.commander.bus;
  std::int64_t next_index = -1, blocks = 0, gaps = 0;
  subscribe<samples_t>(bus, channel::kSamples, [&](const samples_t& s) {
    if (next_index >= 0 && s.first_index != next_index) ++gaps;
    next_index = s.first_index + s.n;
    if (++blocks % 8 != 0) return;
    imrig_msg::ack_t ack = {};
    ack.ack_v1 = 1;
    ack.boot_id = s.boot_id;
    ack.read_index = next_index;
    ack.process = heartbeat_t::RECORDER;
    publish(bus, channel::kAck, ack);
  });
  ASSERT_TRUE(rig.commander.until([&] { return blocks > 100; }));
  const std::int64_t from_us = monotonic_us(), from_blocks = blocks;
  const double from_cpu_s = rig.bridge.cpu_s();
  ASSERT_TRUE(rig.commander.until([&] { return blocks > from_blocks + 20'000; }, 60'000));
  const double wall_s = static_cast<double>(monotonic_us() - from_us) * 1e-6;
  const double n = static_cast<double>(blocks - from_blocks);
  std::printf("%.0f blocks/s, %.1f us of the bridge's processor time a block\n", n / wall_s,
              (rig.bridge.cpu_s() - from_cpu_s) / n * 1e6);
  EXPECT_EQ(gaps, 0);
  EXPECT_EQ(rig.commander.status()->lost_blocks, 0);
}

TEST(BridgeProcess, LeaseStartAndStopDriveTheMotor) {
  Rig rig;
  ASSERT_TRUE(rig.commander.drive());
  ASSERT_TRUE(
      rig.commander.until([&] { return rig.device.gates_on && rig.commander.is(bridge_status_t::RUNNING); }));
  EXPECT_EQ(rig.commander.act(bridge_cmd_t::STOP), CommandResult::kDone);
  ASSERT_TRUE(
      rig.commander.until([&] { return !rig.device.gates_on && rig.commander.is(bridge_status_t::IDLE); }));
  EXPECT_EQ(rig.commander.status()->trip, 0);
}

TEST(BridgeProcess, RecordedSessionPlayedBackMovesNothing) {
  Rig rig;
  std::vector<std::pair<std::string, std::vector<std::uint8_t>>> log;
  bool recording = true;
  for (const char* name : {channel::kLeaseCmd, channel::kBridgeCmd}) {
    rig.commander.bus->subscribe_raw(name, [&log, &recording, name](std::string_view, Bytes data) {
      if (recording) log.emplace_back(name, std::vector<std::uint8_t>(data.begin(), data.end()));
    });
  }
  ASSERT_TRUE(rig.commander.drive());
  ASSERT_EQ(rig.commander.act(bridge_cmd_t::STOP), CommandResult::kDone);
  ASSERT_TRUE(rig.commander.until([&] { return rig.commander.is(bridge_status_t::IDLE); }));
  recording = false;
  ASSERT_GE(log.size(), 4u);
  for (const bool held : {true, false}) {  // once while we hold the lease, once when it is free
    if (!held) {
      rig.commander.lease.release();
      rig.commander.until([] { return false; }, 500);
    }
    bool drove = false;
    for (int round = 0; round < 3; ++round) {
      for (const auto& [name, data] : log) {
        rig.commander.bus->publish_raw(name, data);
        rig.commander.until([] { return false; }, 20);
        drove = drove || rig.device.gates_on || !rig.commander.is(bridge_status_t::IDLE);
      }
    }
    EXPECT_FALSE(drove) << (held ? "lease held" : "lease free");
  }
}

TEST(BridgeProcess, StaleCommandIsRefused) {
  Rig rig;
  ASSERT_TRUE(rig.commander.drive());
  ASSERT_TRUE(rig.commander.until([&] { return rig.device.gates_on.load(); }));
  bridge_cmd_t cmd = {};
  cmd.bridge_cmd_v1 = 1;
  cmd.action = bridge_cmd_t::STOP;
  rig.commander.lease.sign(cmd, {monotonic_us(), wall_us() - 10'000'000}, 5000);
  publish(*rig.commander.bus, channel::kBridgeCmd, cmd);
  ASSERT_TRUE(rig.commander.until([&] { return rig.commander.status()->last_cmd_seq == cmd.seq; }));
  EXPECT_EQ(rig.commander.status()->last_cmd_result, static_cast<std::int32_t>(CommandResult::kStale));
  EXPECT_TRUE(rig.device.gates_on);
}

TEST(BridgeProcess, EmergencyStopOpensTheGatesWithinFiftyMilliseconds) {
  Rig rig;
  std::vector<std::int64_t> took_us;
  for (std::int32_t k = 1; k <= 5; ++k) {
    ASSERT_TRUE(rig.commander.drive(k));
    ASSERT_TRUE(rig.commander.until([&] { return rig.device.gates_on.load(); }));
    const std::int64_t from_us = monotonic_us();
    rig.commander.estop();
    ASSERT_TRUE(rig.gates_open_within(5000));
    took_us.push_back(rig.device.gates_off_us - from_us);
    ASSERT_TRUE(rig.commander.until([&] { return rig.commander.is(bridge_status_t::TRIPPED); }));
    EXPECT_EQ(rig.commander.status()->trip, static_cast<std::int32_t>(Trip::kOperatorStop));
    ASSERT_EQ(rig.commander.act(bridge_cmd_t::RESET), CommandResult::kDone);
  }
  std::sort(took_us.begin(), took_us.end());
  std::printf("emergency stop to gates off: %lld to %lld us\n", static_cast<long long>(took_us.front()),
              static_cast<long long>(took_us.back()));
  EXPECT_LT(took_us[2], 50'000);  // the median: a single one may meet a machine that sleeps
}

TEST(BridgeProcess, SilentLinkTripsAndNothingResumes) {
  Rig rig;
  ASSERT_TRUE(rig.commander.drive());
  rig.device.mute = true;
  ASSERT_TRUE(rig.commander.until([&] { return rig.commander.is(bridge_status_t::TRIPPED); }));
  EXPECT_EQ(rig.commander.status()->trip, static_cast<std::int32_t>(Trip::kLinkSilent));
  EXPECT_EQ(rig.commander.status()->link_state, bridge_status_t::LINK_SILENT);
  ASSERT_TRUE(rig.gates_open_within(10'000)) << "the device's own watchdog";
  rig.device.mute = false;
  ASSERT_TRUE(
      rig.commander.until([&] { return rig.commander.status()->link_state == bridge_status_t::LINK_UP; }));
  rig.commander.until([] { return false; }, 500);
  EXPECT_TRUE(rig.commander.is(bridge_status_t::TRIPPED));
  EXPECT_FALSE(rig.device.gates_on);
}

TEST(BridgeProcess, HotWindingTrips) {
  Rig rig;
  ASSERT_TRUE(rig.commander.drive());
  rig.device.stator_C = 200.0f;
  ASSERT_TRUE(rig.gates_open_within(10'000));
  ASSERT_TRUE(rig.commander.until([&] { return rig.commander.is(bridge_status_t::TRIPPED); }));
  EXPECT_TRUE(rig.commander.until([&] { return rig.commander.status()->stator_C == 200.0; }));
}

TEST(BridgeProcess, KilledLeaseHolderLeadsToAStop) {
  Rig rig;
  Process holder({"bridge_commander", rig.file.path()});
  ASSERT_EQ(holder.first_line(), "driving");
  ASSERT_TRUE(
      rig.commander.until([&] { return rig.device.gates_on && rig.commander.is(bridge_status_t::RUNNING); }));
  const std::int64_t from_us = monotonic_us();
  holder.signal(SIGKILL);
  ASSERT_TRUE(rig.gates_open_within(20'000));
  std::printf("killed lease holder to gates off: %lld ms with a lease of %d ms\n",
              static_cast<long long>((rig.device.gates_off_us - from_us) / 1000), rig.config.limits.lease_ms);
  ASSERT_TRUE(rig.commander.until([&] { return rig.commander.is(bridge_status_t::TRIPPED); }));
  EXPECT_EQ(rig.commander.status()->trip, static_cast<std::int32_t>(Trip::kLeaseLost));
}

TEST(BridgeProcess, TerminationLeavesTheGatesOff) {
  for (const int number : {SIGTERM, SIGINT}) {
    Rig rig;
    ASSERT_TRUE(rig.commander.drive());
    ASSERT_TRUE(rig.commander.until([&] { return rig.device.gates_on.load(); }));
    const std::int64_t from_us = monotonic_us();
    rig.bridge.signal(number);
    EXPECT_EQ(rig.bridge.wait(), 0);
    std::printf("signal %d to the end of the process: %lld ms\n", number,
                static_cast<long long>((monotonic_us() - from_us) / 1000));
    // The device's thread may still have the last frame to read.
    EXPECT_TRUE(rig.gates_open_within(1'000));
    EXPECT_EQ(rig.device.trip, 0) << "ramped down, not tripped";
    rig.commander.until([] { return false; }, 100);
    EXPECT_EQ(rig.commander.heartbeat->state, heartbeat_t::STOPPING);
  }
}

TEST(BridgeProcess, KilledBridgeLeavesTheDeviceToItsWatchdogAndTheNextBridgeTakesNothingOver) {
  Rig rig;
  ASSERT_TRUE(rig.commander.drive());
  ASSERT_TRUE(rig.commander.until([&] { return rig.device.gates_on.load(); }));
  rig.bridge.signal(SIGKILL);
  EXPECT_EQ(rig.bridge.wait(), 128 + SIGKILL);
  ASSERT_TRUE(rig.gates_open_within(10'000));
  EXPECT_EQ(rig.device.trip, IMRIG_TRIP_WATCHDOG);
  Process next({"imrig-bridge", "--config", rig.file.path()});
  ASSERT_EQ(next.first_line(), "ready");
  ASSERT_TRUE(rig.commander.until([&] { return rig.commander.is(bridge_status_t::TRIPPED); }));
  EXPECT_EQ(rig.commander.status()->trip, static_cast<std::int32_t>(Trip::kDeviceWatchdog));
  EXPECT_FALSE(rig.device.gates_on);
}

TEST(BridgeProcess, AbsentDeviceIsReportedAndTheProcessStays) {
  RigConfig config;
  {
    DevicePartner gone;
    config = test_rig(gone.url());
  }
  RigFile file(to_toml(config));
  Commander commander(config);
  Process bridge({"imrig-bridge", "--config", file.path()});
  ASSERT_EQ(bridge.first_line(), "ready");
  ASSERT_TRUE(commander.until([&] { return commander.status() && commander.heartbeat; }));
  commander.until([] { return false; }, 500);
  EXPECT_EQ(commander.status()->link_state, bridge_status_t::LINK_ABSENT);
  EXPECT_EQ(commander.heartbeat->state, heartbeat_t::DEGRADED);
  ASSERT_TRUE(commander.take_lease());
  EXPECT_EQ(commander.act(bridge_cmd_t::START, 1), CommandResult::kLinkAbsent);
  bridge.signal(SIGTERM);
  EXPECT_EQ(bridge.wait(), 0);
}

void expect_refused(const std::vector<std::string>& argv, const std::string& word) {
  Process bridge(argv);
  EXPECT_EQ(bridge.wait(), 2) << word;
  const std::string said = bridge.errors();
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 1) << said;
  EXPECT_NE(said.find(word), std::string::npos) << said;
}

TEST(BridgeProcess, BadConfigurationIsOneSentenceAndExitCodeTwo) {
  expect_refused({"imrig-bridge", "--config", "/nowhere/rig.toml"}, "/nowhere/rig.toml");
  expect_refused({"imrig-bridge", "--cofnig", "rig.toml"}, "--cofnig");
  const auto refused = [](const std::function<void(RigConfig&)>& change, const std::string& word) {
    RigConfig config = test_rig("udp://127.0.0.1:9");
    change(config);
    const RigFile file(to_toml(config));
    expect_refused({"imrig-bridge", "--config", file.path()}, word);
  };
  refused([](RigConfig& c) { c.bridge.link = "carrier-pigeon://loft"; }, "carrier-pigeon");
  refused([](RigConfig& c) { c.bridge.link = "serial:///dev/no-such-tty?baud=115200"; }, "/dev/no-such-tty");
  refused([](RigConfig& c) { c.bridge.link = "serial:///etc/hostname"; }, "/etc/hostname");
  refused([](RigConfig& c) { c.bus.url = "udpm://not an address"; }, "not an address");
}

}  // namespace
}  // namespace imrig
