#include <gtest/gtest.h>

#include <imrig_msg/ack_t.hpp>
#include <imrig_msg/bridge_status_t.hpp>
#include <imrig_msg/heartbeat_t.hpp>
#include <nlohmann/json.hpp>

#include "rig/recorder/ack_keeper.h"
#include "rig/recorder/log_index.h"
#include "rig/recorder/stream_watch.h"
#include "tests/rig/bus/messages.h"

namespace imrig::test {
namespace {

std::int64_t see(StreamWatch& watch, std::initializer_list<std::int64_t> numbers) {
  std::int64_t lost = 0;
  for (const auto seq : numbers) lost += watch.see({"S", seq});
  return lost;
}

TEST(StreamWatch, JumpIsLossAndWhatComesLateIsNone) {
  StreamWatch watch;
  EXPECT_EQ(see(watch, {100, 101, 102}), 0);
  EXPECT_EQ(see(watch, {106, 107}), 3);
  EXPECT_EQ(see(watch, {104}), -1);
  EXPECT_EQ(watch.streams().at("S").lost, 2);
  EXPECT_EQ(watch.streams().at("S").received, 6);
  EXPECT_EQ(watch.streams().at("S").restarts, 0);
}

TEST(StreamWatch, MessageThatComesTwiceIsNoLoss) {
  StreamWatch watch;
  EXPECT_EQ(see(watch, {100, 101, 101, 100, 102}), 0);
}

TEST(StreamWatch, SenderThatBeginsAnewIsNoLoss) {
  StreamWatch watch;
  EXPECT_EQ(see(watch, {100, 101, 1, 2, 3}), 0);
  EXPECT_EQ(watch.streams().at("S").restarts, 1);
  EXPECT_EQ(see(watch, {5}), 1);
}

TEST(StreamWatch, AbsurdNumbersDoNoHarm) {
  StreamWatch watch;
  constexpr auto kMax = std::numeric_limits<std::int64_t>::max();
  EXPECT_EQ(see(watch, {kMax, -kMax, 0, kMax, kMax, 5}), 0);
}

TEST(StreamWatch, SendersThatShareAChannelAreStreamsOfTheirOwn) {
  imrig_msg::heartbeat_t beat = {};
  beat.heartbeat_v1 = 1;
  beat.process = imrig_msg::heartbeat_t::BRIDGE;
  beat.instance = 5;
  beat.seq = 17;
  const auto a = stream_place("HEARTBEAT", encoded(beat));
  beat.instance = 6;
  const auto b = stream_place("HEARTBEAT", encoded(beat));
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->seq, 17);
  EXPECT_NE(a->stream, b->stream);
  imrig_msg::samples_t block = samples();
  block.seq = 3;
  const auto first = stream_place("SAMPLES", encoded(block));
  block.boot_id = 78;
  EXPECT_NE(stream_place("SAMPLES", encoded(block))->stream, first->stream);
}

TEST(StreamWatch, CommandsAndMalformedMessagesAreNoStream) {
  EXPECT_FALSE(stream_place("BRIDGE_CMD", ByteVector(1000)));
  EXPECT_FALSE(stream_place("BRIDGE_STATUS", ByteVector(10)));
  EXPECT_FALSE(stream_place("SAMPLES", ByteVector(100)));
  EXPECT_FALSE(stream_place("CAMERA", ByteVector(100)));
}

imrig_msg::samples_t block_at(std::int64_t first, std::int64_t boot = 77) {
  imrig_msg::samples_t m = samples(100);
  m.first_index = first;
  m.boot_id = boot;
  return m;
}

TEST(AckKeeper, EveryFourthBlockIsAcknowledgedAtOnceAndTheRestAfter20Ms) {
  AckKeeper acks;
  EXPECT_FALSE(acks.due(0, false, 0, 0));  // nothing to follow yet
  acks.on_samples(block_at(0));
  ASSERT_TRUE(acks.due(1000, false, 0, 0));  // a new boot is acknowledged at once
  for (int k = 1; k < 4; ++k) {
    acks.on_samples(block_at(100 * k));
    EXPECT_FALSE(acks.due(1000 + k, false, 0, 0));
  }
  acks.on_samples(block_at(400));
  const auto ack = acks.due(1004, false, 2, 9);
  ASSERT_TRUE(ack);
  EXPECT_EQ(ack->boot_id, 77);
  EXPECT_EQ(ack->read_index, 500);
  EXPECT_EQ(ack->lost_blocks, 2);
  EXPECT_EQ(ack->flushed_record, 9);
  EXPECT_EQ(ack->process, imrig_msg::heartbeat_t::RECORDER);
  acks.on_samples(block_at(500));
  EXPECT_FALSE(acks.due(20000, false, 0, 0));
  EXPECT_EQ(acks.due(21100, false, 0, 0)->read_index, 600);
  EXPECT_FALSE(acks.due(21200, false, 0, 0));
  EXPECT_TRUE(acks.due(41200, false, 0, 0));  // said again while nothing comes
}

TEST(AckKeeper, IndexStandsStillWhileTheDiskIsBehind) {
  AckKeeper acks;
  for (int k = 0; k < 4; ++k) acks.on_samples(block_at(100 * k));
  EXPECT_EQ(acks.due(0, false, 0, 0)->read_index, 400);
  for (int k = 4; k < 12; ++k) acks.on_samples(block_at(100 * k));
  EXPECT_FALSE(acks.due(100, true, 0, 0));
  EXPECT_EQ(acks.due(20000, true, 0, 0)->read_index, 400);
  EXPECT_EQ(acks.due(40000, false, 0, 0)->read_index, 1200);
}

TEST(AckKeeper, NewBootBeginsAtItsOwnIndex) {
  AckKeeper acks;
  acks.on_samples(block_at(100000));
  EXPECT_EQ(acks.due(0, false, 0, 0)->read_index, 100100);
  acks.on_samples(block_at(0, 78));
  const auto ack = acks.due(1, false, 0, 0);
  ASSERT_TRUE(ack);
  EXPECT_EQ(ack->boot_id, 78);
  EXPECT_EQ(ack->read_index, 100);
}

TEST(LogIndex, CountsChannelsLossesAndRecords) {
  LogIndex index("IMRIG");
  imrig_msg::bridge_status_t status = {};
  status.bridge_status_v1 = 1;
  for (const std::int64_t seq : {1, 2, 5}) {
    status.seq = seq;
    index.add(1000 * seq, "IMRIG_BRIDGE_STATUS", encoded(status), 10 * seq);
  }
  imrig_msg::record_t mark = record("p1");
  mark.number = 7;
  index.add(6000, "IMRIG_RECORD", encoded(mark), 100);
  EXPECT_EQ(index.begun_record(), 7);
  EXPECT_EQ(index.ended_record(), 0);
  mark.phase = imrig_msg::record_t::END;
  mark.samples = 500;
  mark.seq = 1;
  index.add(7000, "IMRIG_RECORD", encoded(mark), 900);
  EXPECT_EQ(index.ended_record(), 7);
  index.add(8000, "IMRIG_RECORD", ByteVector(50), 1000);  // malformed
  EXPECT_EQ(index.ended_record(), 0);

  const auto json = nlohmann::json::parse(index.to_json("a.lcm", 1234, {1, 2, 3}));
  EXPECT_EQ(json.at("bytes"), 1234);
  EXPECT_EQ(json.at("kernel_drops"), 1);
  EXPECT_EQ(json.at("memory_drops"), 2);
  const auto& channel = json.at("channels").at("IMRIG_BRIDGE_STATUS");
  EXPECT_EQ(channel.at("count"), 3);
  EXPECT_EQ(channel.at("lost"), 2);
  EXPECT_EQ(channel.at("first_utime"), 1000);
  EXPECT_EQ(channel.at("last_utime"), 5000);
  EXPECT_EQ(json.at("channels").at("IMRIG_RECORD").at("count"), 3);
  ASSERT_EQ(json.at("records").size(), 1u);
  const auto& entry = json.at("records").at(0);
  EXPECT_EQ(entry.at("id"), "p1");
  EXPECT_EQ(entry.at("begin_offset"), 100);
  EXPECT_EQ(entry.at("end_offset"), 900);
  EXPECT_EQ(entry.at("status"), "complete");
  EXPECT_EQ(entry.at("samples"), 500);
}

}  // namespace
}  // namespace imrig::test
