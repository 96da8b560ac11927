#include "rig/bus/replay.h"

#include <gtest/gtest.h>

#include <chrono>
#include <imrig_msg/heartbeat_t.hpp>
#include <limits>

#include "tests/rig/bus/messages.h"
#include "tests/rig/bus/wire.h"

namespace imrig::test {
namespace {

constexpr double kMax = std::numeric_limits<double>::infinity();

void write_messages(const std::string& path, int n, std::int64_t step_us) {
  EventLogWriter log(path);
  for (int k = 0; k < n; ++k) {
    log.write(1700000000000000 + step_us * k, k % 10 == 3 ? "IMRIG_BRIDGE_CMD" : "IMRIG_STATUS",
              ByteVector{static_cast<std::uint8_t>(k)});
  }
}

imrig_msg::heartbeat_t beat(std::int64_t instance) {
  imrig_msg::heartbeat_t m = {};
  m.heartbeat_v1 = 1;
  m.instance = instance;
  m.process = imrig_msg::heartbeat_t::DYNO;
  m.pid = 4711;
  return m;
}

double seconds_of(const std::function<void()>& body) {
  const auto begin = std::chrono::steady_clock::now();
  body();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

TEST(Replay, EverythingButCommandsGoesOutInOrder) {
  const Folder folder;
  const int port = free_udp_port();
  write_messages(folder / "a.lcm", 1000, 100);
  const auto listener = open_lcm_bus(bus_config(port));
  std::vector<std::uint8_t> heard;
  bool command = false;
  listener->subscribe_raw("*", [&](std::string_view name, Bytes data) {
    heard.push_back(data[0]);
    command = command || name != "IMRIG_STATUS";
  });
  EventLogReader log(folder / "a.lcm");
  const ReplayReport report = replay(log, open_lcm_player(bus_config(port)), {kMax, 20000.0, {}});
  EXPECT_EQ(report.played, 900);
  EXPECT_EQ(report.commands_left_out, 100);
  EXPECT_FALSE(report.stopped);
  ASSERT_TRUE(wait_until(*listener, [&] { return heard.size() == 900; }));
  EXPECT_FALSE(command);
  std::size_t at = 0;
  for (int k = 0; k < 1000; ++k) {
    if (k % 10 == 3) continue;
    EXPECT_EQ(heard[at++], static_cast<std::uint8_t>(k));
  }
}

TEST(Replay, SpeedScalesTheLogsOwnTimes) {
  const Folder folder;
  write_messages(folder / "a.lcm", 21, 100000);  // 2 s
  EventLogReader log(folder / "a.lcm");
  const double seconds = seconds_of([&] { replay(log, [](const std::string&, Bytes) {}, {4.0, 1e5, {}}); });
  EXPECT_GE(seconds, 0.49);
}

TEST(Replay, RateIsBoundedEvenAtFullSpeed) {
  const Folder folder;
  write_messages(folder / "a.lcm", 3000, 0);
  EventLogReader log(folder / "a.lcm");
  const double seconds = seconds_of([&] {
    replay(log, [](const std::string&, Bytes) {}, {kMax, 10000.0, {}});
  });
  EXPECT_GE(seconds, 2700 / 10000.0 - 0.002);  // a millisecond's lateness may be made up for
}

TEST(Replay, StopsWhenAsked) {
  const Folder folder;
  write_messages(folder / "a.lcm", 100, 3600000000ll);
  EventLogReader log(folder / "a.lcm");
  int asked = 0;
  const ReplayReport report =
      replay(log, [](const std::string&, Bytes) {}, {1.0, 1e5, [&] { return ++asked < 4; }});
  EXPECT_TRUE(report.stopped);
  EXPECT_EQ(report.played, 1);
}

TEST(Replay, LiveProcessesAreHeardUnderAnyPrefix) {
  const int port = free_udp_port();
  std::atomic<bool> stop = false;
  std::thread rig([&] {
    const auto bus = open_lcm_bus(bus_config(port, "OTHER"));
    while (!stop) {
      publish(*bus, "HEARTBEAT", beat(1));
      publish(*bus, "HEARTBEAT", beat(2));
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  });
  const auto live = live_heartbeats(*open_lcm_bus(bus_config(port)), 2000);
  stop = true;
  rig.join();
  ASSERT_EQ(live.size(), 2u);
  EXPECT_EQ(process_name(live[0].process), "imrig-dyno");
  EXPECT_EQ(live[0].pid, 4711);
  EXPECT_EQ(live[0].channel, "OTHER_HEARTBEAT");
}

TEST(Replay, QuietBusHasNobodyOnIt) {
  EXPECT_TRUE(live_heartbeats(*open_lcm_bus(bus_config(free_udp_port())), 300).empty());
}

TEST(Replay, CommandsAreWhatEndsInCmd) {
  EXPECT_TRUE(is_command_channel("IMRIG_BRIDGE_CMD"));
  EXPECT_TRUE(is_command_channel("LAB_3_ESTOP_CMD"));
  EXPECT_FALSE(is_command_channel("IMRIG_CMD_STATUS"));
}

}  // namespace
}  // namespace imrig::test
