// The same samples give the same estimates to the bit: live on a running rig, from its log through imrig replay,
// through Debian's lcm-logplayer, and from file://LOG?speed=0. Real processes throughout.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <imrig_msg/ack_t.hpp>
#include <imrig_msg/heartbeat_t.hpp>
#include <imrig_msg/motor_estimate_t.hpp>
#include <imrig_msg/samples_t.hpp>

#include "rig/base/file.h"
#include "tests/estimators/online/estimate_stream.h"
#include "tests/rig/bus/wire.h"

namespace imrig::test {
namespace {

RigConfig rig_of_its_own() {
  RigConfig rig = load_rig_config(source("models/rigs/proca_5hp.toml"));
  rig.bus.url = url_of(free_udp_port());
  rig.bridge.link = "udp://127.0.0.1:" + std::to_string(free_udp_port());
  rig.dyno.link = "tcp://127.0.0.1:" + std::to_string(free_tcp_port());
  return rig;
}

class ReplayRoutes : public ::testing::Test {
 protected:
  // A campaign with recorder and estimator on the bus before the first sample.
  void SetUp() override {
    const RigConfig rig = rig_of_its_own();
    write_text_atomically(config_, to_toml(rig));
    const auto bus = open_lcm_bus(rig.bus);
    int alive = 0;
    subscribe<imrig_msg::heartbeat_t>(*bus, channel::kHeartbeat, [&](const auto& m) {
      alive |= 1 << m.process;
    });
    Background recorder({"imrig-recorder", "--config", config_, "--out", log_}, folder_ / "recorder.out");
    Background estimator({"imrig-estimator", "--config", config_, "--out", live_}, folder_ / "estimator.out");
    const auto up = [&](std::initializer_list<int> processes) {
      int wanted = 0;
      for (const int p : processes) wanted |= 1 << p;
      return wait_until(*bus, [&] { return (alive & wanted) == wanted; });
    };
    using imrig_msg::heartbeat_t;
    ASSERT_TRUE(up({heartbeat_t::RECORDER, heartbeat_t::ESTIMATOR}));
    Background emulator({"imrig-emulator", "--config", source("models/plants/proca_5hp.toml"), "--link", rig.bridge.link, "--modbus",
                         rig.dyno.link, "--pace", "max", "--integrator", "rk4"},
                        folder_ / "emulator.out");
    Background bridge({"imrig-bridge", "--config", config_}, folder_ / "bridge.out");
    Background dyno({"imrig-dyno", "--config", config_}, folder_ / "dyno.out");
    ASSERT_TRUE(up({heartbeat_t::BRIDGE, heartbeat_t::DYNO})) << read_text(folder_ / "bridge.out");
    const Outcome campaign = run({"imrig", "campaign", "run", source("campaigns/smoke.toml"), "--config", config_, "--out", folder_ / "campaign"});
    ASSERT_EQ(campaign.exit_code, 0) << campaign.out << campaign.err;
    bridge.stop();
    estimator.stop();
    recorder.stop();
    dyno.stop();
    emulator.stop();
    const Outcome file = from_file(folder_ / "file.lcm");
    ASSERT_EQ(file.exit_code, 0) << file.err;
    reference_ = estimates_of(folder_ / "file.lcm");
    ASSERT_GT(reference_.messages.size(), 100u);
  }

  Outcome from_file(const std::string& out, const std::string& log = "") const {
    return run({"imrig-estimator", "--config", config_, "--url", "file://" + (log.empty() ? log_ : log) + "?speed=0", "--out", out});
  }

  // Through a player on a bus of its own; a datagram that the machine loses gets the route another try.
  EstimateStream through(const std::vector<std::string>& player, const std::string& name) {
    EstimateStream got;
    for (int attempt = 0; attempt < 3; ++attempt) {
      got = played(player, folder_ / fmt::format("{}{}.lcm", name, attempt));
      if (got == reference_) break;
    }
    return got;
  }

  EstimateStream played(std::vector<std::string> player, const std::string& out) {
    const std::string url = url_of(free_udp_port());
    const auto bus = open_lcm_bus({url, "IMRIG"});
    std::int64_t read = 0;
    int pid = -1;
    bool alive = false;
    subscribe<imrig_msg::heartbeat_t>(*bus, channel::kHeartbeat, [&](const auto& m) { alive = alive || m.pid == pid; });
    subscribe<imrig_msg::ack_t>(*bus, channel::kAck, [&](const auto& m) {
      if (m.pid == pid) read = m.read_index;
    });
    Background estimator({"imrig-estimator", "--config", config_, "--url", url, "--out", out}, out + ".out");
    pid = estimator.pid();
    EXPECT_TRUE(wait_until(*bus, [&] { return alive; }));
    for (std::string& word : player) {
      if (word == "URL") word = url;
      if (word == "LOG") word = log_;
    }
    const Outcome outcome = run(player);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    const std::int64_t end = end_index();
    wait_until(*bus, [&] { return read >= end; }, 20);
    estimator.stop();
    return estimates_of(out);
  }

  std::int64_t end_index() const {
    EventLogReader reader(log_);
    LogEvent event;
    std::int64_t end = 0;
    while (reader.next(event)) {
      if (!event.channel.ends_with("_SAMPLES")) continue;
      if (const auto block = guarded_decode<imrig_msg::samples_t>(event.data)) end = block->first_index + block->n;
    }
    return end;
  }

  Folder folder_;
  std::string config_ = folder_ / "rig.toml", log_ = folder_ / "rig.lcm", live_ = folder_ / "live.lcm";
  EstimateStream reference_;
};

TEST_F(ReplayRoutes, LiveReplayedPlayedAndReadGiveTheSameBits) {
  // Live, as kept by the estimator itself and as the recorder received it; the log may end a few blocks apart.
  EstimateStream live = estimates_of(live_), recorded = estimates_of(log_);
  for (EstimateStream* one : {&live, &recorded}) {
    ASSERT_LE(std::max(one->messages.size(), reference_.messages.size()) - std::min(one->messages.size(), reference_.messages.size()), 8u);
    EstimateStream cut = reference_;
    const std::size_t common = std::min(one->messages.size(), cut.messages.size());
    one->messages.resize(common);
    cut.messages.resize(common);
    EXPECT_EQ(hash_of(*one), hash_of(cut)) << (one == &live ? "live" : "recorded");
  }
  const auto same = [&](const EstimateStream& got, const char* route) {
    fmt::print("{:<28}{:5} estimates, hash {:016x}\n", route, got.messages.size(), hash_of(got));
    EXPECT_EQ(got.messages.size(), reference_.messages.size()) << route;
    EXPECT_EQ(hash_of(got), hash_of(reference_)) << route;
  };
  same(reference_, "file://LOG?speed=0");
  same(live, "live");
  same(through({"imrig", "replay", "LOG", "--url", "URL", "--followers", "--speed", "max"}, "replay_max"), "imrig replay --speed max");
  same(through({"imrig", "replay", "LOG", "--url", "URL", "--followers", "--speed", "2"}, "replay_2"), "imrig replay --speed 2");
  same(through({"lcm-logplayer", "-l", "URL", "-s", "1", "LOG"}, "player_1"), "lcm-logplayer -s 1");
  same(through({"lcm-logplayer", "-l", "URL", "-s", "3", "LOG"}, "player_3"), "lcm-logplayer -s 3");
  for (int k = 0; k < 10; ++k) {
    const std::string out = folder_ / fmt::format("again{}.lcm", k);
    ASSERT_EQ(from_file(out).exit_code, 0);
    EXPECT_EQ(hash_of(estimates_of(out)), hash_of(reference_));
  }
}

// Blocks taken out of the log: every estimate behind a hole says how many samples it has missed, windows are whole,
// and the estimates behind it are those of a motor that never stopped.
TEST_F(ReplayRoutes, AGapIsSeenMarkedAndSurvived) {
  const std::string holed = folder_ / "holed.lcm";
  struct Hole {
    std::int64_t first, n;
  };
  std::vector<Hole> holes;
  std::int64_t last_index = 0;
  {
    EventLogReader reader(log_);
    EventLogWriter writer(holed);
    LogEvent event;
    int blocks = 0;
    while (reader.next(event)) {
      if (event.channel.ends_with("_SAMPLES")) {
        const auto block = guarded_decode<imrig_msg::samples_t>(event.data);
        ASSERT_TRUE(block);
        last_index = block->first_index + block->n - 1;
        if (++blocks % 400 == 0) {
          holes.push_back({block->first_index, block->n});
          continue;
        }
      }
      writer.write(event.utime, event.channel, event.data);
    }
  }
  ASSERT_GE(holes.size(), 3u);
  const Outcome outcome = from_file(folder_ / "gaps.lcm", holed);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.out.find(" 0 lost blocks"), std::string::npos) << outcome.out;
  std::int64_t seen = 0, previous_missing = 0, valid_behind = 0;
  EventLogReader reader(folder_ / "gaps.lcm");
  LogEvent event;
  while (reader.next(event)) {
    const auto m = guarded_decode<imrig_msg::motor_estimate_t>(event.data);
    if (!m) continue;
    EXPECT_GE(m->missing_samples, previous_missing);
    previous_missing = m->missing_samples;
    seen = std::max(seen, m->last_index);
    if (m->missing_samples > 0 && m->steady == 1) {
      ++valid_behind;
      EXPECT_LT(m->residual_share.value, 0.02);
    }
  }
  std::int64_t missing = 0;  // up to the last estimate
  for (const Hole& h : holes) missing += h.first < seen ? h.n : 0;
  EXPECT_EQ(previous_missing, missing);
  EXPECT_GT(valid_behind, 10);
  EXPECT_GT(seen, last_index - 20000);
}

}  // namespace
}  // namespace imrig::test
