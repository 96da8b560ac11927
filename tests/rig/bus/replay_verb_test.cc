// imrig replay over real UDP.

#include <gtest/gtest.h>

#include <atomic>
#include <imrig_msg/heartbeat_t.hpp>

#include "rig/base/error.h"
#include "rig/base/file.h"
#include "rig/cli/verbs.h"
#include "tests/rig/bus/campaign_log.h"
#include "tests/rig/bus/wire.h"

namespace imrig::test {
namespace {

int replay_verb(const std::string& words) {
  CLI::App app;
  int exit_code = 0;
  add_replay(app, exit_code);
  app.parse("replay " + words);
  return exit_code;
}

std::string made_log(const Folder& folder) {
  CampaignLog log(folder / "a.lcm");
  log.rest(0.1);
  log.write_raw("IMRIG_BRIDGE_CMD", ByteVector(30));
  log.take(1, "p1", 1000);
  log.close();
  return folder / "a.lcm";
}

TEST(ReplayVerb, PlaysOntoAQuietBusOfItsConfiguration) {
  const Folder folder;
  const int port = free_udp_port();
  write_text_atomically(folder / "rig.toml", "version = 1\n[bus]\nurl = \"" + url_of(port) + "\"\n");
  const auto bus = open_lcm_bus(bus_config(port));
  std::vector<std::string> heard;
  bus->subscribe_raw("*", [&](std::string_view name, Bytes) { heard.emplace_back(name); });
  const std::string log = made_log(folder);
  std::vector<std::string> expected;
  for (const auto& e : all_events(log)) {
    if (e.channel != "IMRIG_BRIDGE_CMD") expected.push_back(e.channel);
  }
  // UDP may lose a datagram even on one machine when it is busy; the verb sends each once. So a loss gets
  // another try, a command never does.
  for (int attempt = 0; attempt < 3 && heard != expected; ++attempt) {
    heard.clear();
    EXPECT_EQ(replay_verb(log + " --speed max --config " + (folder / "rig.toml")), 0);
    wait_until(
        *bus, [&] { return heard.size() >= expected.size(); }, 5);
    EXPECT_EQ(std::count(heard.begin(), heard.end(), "IMRIG_BRIDGE_CMD"), 0);
  }
  EXPECT_EQ(heard, expected);
}

TEST(ReplayVerb, RefusesABusThatSomebodyLivesOn) {
  const Folder folder;
  const int port = free_udp_port();
  std::atomic<bool> stop = false;
  std::atomic<int> played = 0;
  std::thread rig([&] {
    const auto bus = open_lcm_bus(bus_config(port));
    bus->subscribe_raw("SAMPLES", [&](std::string_view, Bytes) { ++played; });
    imrig_msg::heartbeat_t beat = {};
    beat.heartbeat_v1 = 1;
    while (!stop) {
      publish(*bus, "HEARTBEAT", beat);
      bus->wait(0);
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  });
  const int exit_code = replay_verb(made_log(folder) + " --speed max --url " + url_of(port));
  stop = true;
  rig.join();
  EXPECT_EQ(exit_code, 1);
  EXPECT_EQ(played, 0);
}

TEST(ReplayVerb, BadInputIsAnError) {
  const Folder folder;
  const std::string log = made_log(folder);
  write_text_atomically(folder / "text.lcm", "no log");
  const std::string url = " --url " + url_of(free_udp_port());
  EXPECT_THROW(replay_verb((folder / "absent.lcm") + url), Error);
  EXPECT_THROW(replay_verb((folder / "text.lcm") + url), Error);
  for (const char* speed : {"0", "-1", "fast", "1x", "nan", "inf"})
    EXPECT_THROW(replay_verb(log + url + " --speed " + speed), Error) << speed;
  EXPECT_THROW(replay_verb(log + " --url udpm://1.2.3.4:5"), Error);
}

}  // namespace
}  // namespace imrig::test
