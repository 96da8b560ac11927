// The process imrig-recorder over real UDP.

#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <filesystem>
#include <imrig_msg/ack_t.hpp>
#include <imrig_msg/heartbeat_t.hpp>
#include <limits>
#include <nlohmann/json.hpp>

#include "rig/base/file.h"
#include "rig/bus/channels.h"
#include "rig/bus/log_records.h"
#include "rig/bus/replay.h"
#include "tests/rig/bus/campaign_log.h"
#include "tests/rig/bus/wire.h"

namespace imrig::test {
namespace {

struct Bench {
  Folder folder;
  int port = free_udp_port();
  std::string config = folder / "rig.toml";
  std::string log = folder / "run.lcm";

  Bench() { write_text_atomically(config, "version = 1\n[bus]\nurl = \"" + url_of(port) + "\"\n"); }
  std::vector<std::string> command() const { return {"imrig-recorder", "--config", config, "--out", log}; }
  std::unique_ptr<Bus> bus() const { return open_lcm_bus(bus_config(port)); }
  nlohmann::json index() const { return nlohmann::json::parse(read_text(log + ".index.json")); }

  // Events of one channel, which the recorder's own messages do not touch.
  std::vector<LogEvent> events(const std::string& channel) const {
    auto all = all_events(log);
    std::erase_if(all, [&](const LogEvent& e) { return e.channel != channel; });
    return all;
  }
};

class Recorder {
 public:
  explicit Recorder(const Bench& bench, std::vector<std::string> extra = {})
      : output_(bench.folder / "said"), process_(with(bench.command(), std::move(extra)), output_) {
    ready_ = wait_until([&] { return said().find("ready") != std::string::npos || !process_.running(); }) &&
             process_.running();
  }
  bool ready() const { return ready_; }
  bool running() const { return process_.running(); }
  int stop() { return process_.stop(); }
  std::string said() const { return std::filesystem::exists(output_) ? read_text(output_) : ""; }

 private:
  static std::vector<std::string> with(std::vector<std::string> words, std::vector<std::string> extra) {
    words.insert(words.end(), extra.begin(), extra.end());
    return words;
  }
  std::string output_;
  Background process_;
  bool ready_ = false;
};

ByteVector numbered(std::int64_t k, std::size_t size = 200) {
  ByteVector bytes(size);
  for (std::size_t b = 0; b < 8; ++b) bytes[b] = static_cast<std::uint8_t>(k >> (8 * b));
  return bytes;
}

// How many messages the kernel surely takes while the recorder does not get its turn: it grants no more than
// net.core.rmem_max.
int kernel_room() { return std::stol(read_text("/proc/sys/net/core/rmem_max")) >= 4194304 ? 2000 : 100; }

void expect_burst_kept(int n) {
  const Bench bench;
  Recorder recorder(bench);
  ASSERT_TRUE(recorder.ready()) << recorder.said();
  const auto bus = bench.bus();
  const int room = kernel_room();
  for (int k = 0; k < n; ++k) {
    bus->publish_raw("BURST", numbered(k));
    if ((k + 1) % room == 0) {
      ASSERT_TRUE(let_kernel_drain(bench.port));
    }
  }
  ASSERT_TRUE(wait_until([&] {
    return std::filesystem::file_size(bench.log) >= static_cast<std::uintmax_t>(n) * (200 + 28 + 11);
  }));
  EXPECT_EQ(recorder.stop(), 0);
  const auto events = bench.events("IMRIG_BURST");
  ASSERT_EQ(events.size(), static_cast<std::size_t>(n));
  for (int k = 0; k < n; ++k) EXPECT_EQ(events[static_cast<std::size_t>(k)].data, numbered(k));
  EXPECT_EQ(bench.index().at("channels").at("IMRIG_BURST").at("count"), n);
  EXPECT_EQ(bench.index().at("kernel_drops"), 0);
}

TEST(Recorder, BurstOf2000MessagesIsKeptWhole) { expect_burst_kept(2000); }
TEST(Recorder, BurstOf20000MessagesIsKeptWhole) { expect_burst_kept(20000); }

TEST(Recorder, SaysItLivesAndAcknowledgesSamples) {
  const Bench bench;
  Recorder recorder(bench);
  ASSERT_TRUE(recorder.ready()) << recorder.said();
  const auto bus = bench.bus();
  std::optional<imrig_msg::heartbeat_t> beat;
  std::optional<imrig_msg::ack_t> ack;
  subscribe<imrig_msg::heartbeat_t>(*bus, channel::kHeartbeat, [&](const auto& m) { beat = m; });
  subscribe<imrig_msg::ack_t>(*bus, channel::kAck, [&](const auto& m) { ack = m; });
  imrig_msg::samples_t block = samples(100);
  for (int k = 0; k < 10; ++k) {
    if (k == 5) block.seq += 3;  // three blocks lost
    publish(*bus, channel::kSamples, block);
    block.first_index += 100;
    ++block.seq;
  }
  EXPECT_TRUE(wait_until(*bus, [&] { return ack && ack->read_index == 1000 && ack->lost_blocks == 3; }));
  imrig_msg::record_t mark = record();
  mark.number = 5;
  publish(*bus, channel::kRecord, mark);
  mark.phase = imrig_msg::record_t::END;
  publish(*bus, channel::kRecord, mark);
  EXPECT_TRUE(wait_until(*bus, [&] { return ack && ack->flushed_record == 5; }));
  ASSERT_TRUE(wait_until(*bus, [&] { return beat.has_value(); }));
  EXPECT_EQ(beat->process, imrig_msg::heartbeat_t::RECORDER);
  EXPECT_EQ(beat->state, imrig_msg::heartbeat_t::OK);
  EXPECT_EQ(recorder.stop(), 0);
  EXPECT_EQ(bench.index().at("channels").at("IMRIG_SAMPLES").at("lost"), 3);
  EXPECT_EQ(bench.index().at("records").at(0).at("status"), "complete");
}

TEST(Recorder, KilledProcessLeavesALogThatReads) {
  const Bench bench;
  Recorder recorder(bench);
  ASSERT_TRUE(recorder.ready()) << recorder.said();
  const auto bus = bench.bus();
  std::int32_t pid = 0;
  subscribe<imrig_msg::heartbeat_t>(*bus, channel::kHeartbeat, [&](const auto& m) { pid = m.pid; });
  ASSERT_TRUE(wait_until(*bus, [&] { return pid > 0; }));
  std::int64_t sent = 0;
  for (; sent < 5000; ++sent) {
    bus->publish_raw("STREAM", numbered(sent, 1000));
    if (sent % 50 == 0) {
      ASSERT_TRUE(let_kernel_drain(bench.port));
    }
    if (sent == 4000) ::kill(pid, SIGKILL);
  }
  ASSERT_TRUE(wait_until([&] { return !recorder.running(); }));
  EXPECT_FALSE(std::filesystem::exists(bench.log + ".index.json"));
  const auto events = bench.events("IMRIG_STREAM");
  ASSERT_GT(events.size(), 100u);
  for (std::size_t k = 0; k < events.size(); ++k)
    EXPECT_EQ(events[k].data, numbered(static_cast<std::int64_t>(k), 1000));
  // And it can be continued.
  Recorder second(bench, {"--append"});
  ASSERT_TRUE(second.ready()) << second.said();
  bus->publish_raw("AFTER", numbered(1));
  ASSERT_TRUE(wait_until([&] { return !bench.events("IMRIG_AFTER").empty(); }));
  EXPECT_EQ(second.stop(), 0);
  EXPECT_EQ(bench.events("IMRIG_STREAM").size(), events.size());
  EXPECT_EQ(bench.index().at("channels").at("IMRIG_STREAM").at("count"), events.size());
}

TEST(Recorder, ReplayIntoItGivesTheSameMessages) {
  const Bench bench;
  CampaignLog made(bench.folder / "made.lcm");
  made.rest(0.3);
  made.take(1, "p1", 20000);
  made.close();
  Recorder recorder(bench);
  ASSERT_TRUE(recorder.ready()) << recorder.said();
  EventLogReader log(bench.folder / "made.lcm");
  const ReplayReport report = replay(log, open_lcm_player(bus_config(bench.port)),
                                     {std::numeric_limits<double>::infinity(), 5000.0, {}});
  ASSERT_TRUE(wait_until([&] {
    return static_cast<std::int64_t>(bench.events("IMRIG_SAMPLES").size() +
                                     bench.events("IMRIG_RECORD").size()) >= report.played;
  }));
  EXPECT_EQ(recorder.stop(), 0);
  auto recorded = all_events(bench.log);
  std::erase_if(recorded,
                [](const LogEvent& e) { return e.channel == "IMRIG_HEARTBEAT" || e.channel == "IMRIG_ACK"; });
  const auto original = all_events(bench.folder / "made.lcm");
  ASSERT_EQ(recorded.size(), original.size());
  for (std::size_t k = 0; k < original.size(); ++k) {
    EXPECT_EQ(recorded[k].channel, original[k].channel);
    EXPECT_EQ(recorded[k].data, original[k].data);
  }
  EXPECT_EQ(read_log(bench.log).hash, read_log(bench.folder / "made.lcm").hash);
}

TEST(Recorder, MalformedDatagramsOnEveryChannelDoNotKillIt) {
  const Bench bench;
  Recorder recorder(bench);
  ASSERT_TRUE(recorder.ready()) << recorder.said();
  ByteVector killer = encoded(samples());
  for (std::size_t k = 0; k < 4; ++k) killer[killer.size() - 3 * 16 - 4 + k] = 0xff;
  RawSender sender(bench.port);
  int sent = 0;
  for (const char* name : {"SAMPLES", "BRIDGE_STATUS", "DYNO_STATUS", "HEARTBEAT", "ACK", "BRIDGE_LEASE",
                           "DYNO_LEASE", "RECORD", "ESTIMATE", "CAMPAIGN_STATUS", "DATASET", "SERIES",
                           "POINTS", "REMARK", "LEASE_CMD", "BRIDGE_CMD", "DYNO_CMD", "ESTOP_CMD"}) {
    for (const std::size_t size :
         {std::size_t{0}, std::size_t{7}, std::size_t{23}, std::size_t{28}, killer.size()}) {
      sender.message(std::string("IMRIG_") + name, Bytes(killer).first(size));
      ++sent;
    }
    sender.bytes(ByteVector{'L', 'C', '0', '2', 0, 0, 0, 1, 'I', 'M', 'R', 'I', 'G',
                            '_'});  // ends inside its channel name
  }
  sender.bytes(ByteVector(3000, 0xff));
  bench.bus()->publish_raw("LAST", numbered(1));
  ASSERT_TRUE(wait_until([&] { return !bench.events("IMRIG_LAST").empty(); }));
  EXPECT_TRUE(recorder.running());
  EXPECT_EQ(recorder.stop(), 0);
  int kept = 0;
  for (const auto& e : all_events(bench.log)) {
    const bool own = (e.channel == "IMRIG_HEARTBEAT" || e.channel == "IMRIG_ACK") && e.data.size() > 0 &&
                     e.data[0] != killer[0];
    kept += !own && e.channel != "IMRIG_LAST" ? 1 : 0;
  }
  EXPECT_GE(kept, sent - 2);  // an empty HEARTBEAT or ACK is told apart by nothing
}

TEST(Recorder, OtherPrefixesAreNotRecordedButCounted) {
  const Bench bench;
  Recorder recorder(bench);
  ASSERT_TRUE(recorder.ready()) << recorder.said();
  open_lcm_bus(bus_config(bench.port, "OTHER"))->publish_raw("X", numbered(1));
  bench.bus()->publish_raw("X", numbered(2));
  ASSERT_TRUE(wait_until([&] { return !bench.events("IMRIG_X").empty(); }));
  EXPECT_EQ(recorder.stop(), 0);
  EXPECT_TRUE(bench.events("OTHER_X").empty());
  EXPECT_EQ(bench.index().at("other_prefixes"), 1);
}

TEST(Recorder, ExistingLogIsNotTouched) {
  const Bench bench;
  write_text_atomically(bench.log, "precious");
  const Outcome outcome = run(bench.command(), 30);
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_NE(outcome.err.find("exists already"), std::string::npos);
  EXPECT_EQ(read_text(bench.log), "precious");
}

TEST(Recorder, BadUsageIsOneSentenceAndLeavesNothingBehind) {
  const Bench bench;
  const auto fails = [&](std::vector<std::string> words) {
    const Outcome outcome = run(words, 30);
    EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    EXPECT_TRUE(outcome.out.empty());
  };
  fails({"imrig-recorder"});
  fails({"imrig-recorder", "--config", bench.folder / "none.toml", "--out", bench.log});
  fails({"imrig-recorder", "--config", bench.config, "--out", bench.folder / "none/a.lcm"});
  fails({"imrig-recorder", "--config", bench.config, "--out", bench.folder.path()});
  write_text_atomically(bench.folder / "bad.toml", "version = 1\n[bus]\nurl = \"udpm://1.2.3.4:7790\"\n");
  fails({"imrig-recorder", "--config", bench.folder / "bad.toml", "--out", bench.log});
  EXPECT_FALSE(std::filesystem::exists(bench.log));
}

}  // namespace
}  // namespace imrig::test
