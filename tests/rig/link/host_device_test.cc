// Host core and device in one process, on a wire that loses, doubles and corrupts what it carries.
#include <gtest/gtest.h>

#include <deque>
#include <map>
#include <random>
#include <set>

#include "rig/link/host.h"
#include "tests/rig/link/device_bench.h"

namespace imrig::test {
namespace {

using Bytes = std::vector<std::uint8_t>;

LinkHostConfig host_config(std::int64_t nonce) {
  LinkHostConfig config;
  config.host_nonce = nonce;
  config.watchdog_ms = 2000;
  config.current_limit_A = 30;
  config.speed_limit_rpm = 3000;
  config.stator_limit_C = 130;
  config.voltage_limit_V = 230;
  config.silence_us = 1000000;
  config.give_up_us = 5000000;
  return config;
}

struct Faults {
  double lost = 0.0, doubled = 0.0, flipped = 0.0;
};

class Pair {
 public:
  Pair(unsigned seed, const Faults& faults) : host(host_config(seed + 1)), faults_(faults), random_(seed) {}

  // One millisecond: both sides hear, the device takes its samples, both sides speak.
  void millisecond() {
    now_us += 1000;
    bench.now_ms = now_us / 1000;
    host.grant(host.next_index() + 64 * 256);  // a credit frame every block, among everything else
    host.poll(now_us);
    for (Bytes packet; host.next_output(packet);) {
      carry(packet, [&](const Bytes& bytes) { bench.feed(bytes); });
    }
    imrig_device_tick(bench.device.get(), bench.now_ms);
    for (int k = 0; k < 17 && connected; ++k) {
      imrig_device_sample(bench.device.get(), &bench.counts);
      tell();
    }
    tell();
    collect();
  }

  void run_ms(int n) {
    for (int k = 0; k < n; ++k) millisecond();
  }
  template <class Condition>
  bool run_until(Condition condition, int most_ms) {
    for (int k = 0; k < most_ms && !condition(); ++k) millisecond();
    return condition();
  }
  bool answered(std::int64_t request) const { return answers.contains(request); }

  LinkHost host;
  DeviceBench bench;
  std::int64_t now_us = 1000000;
  bool connected = true;
  std::map<std::int64_t, std::vector<std::int32_t>> answers;
  std::vector<LinkBlock> blocks;
  std::int64_t first_block = 0;  // as the first welcome that arrived says
  int welcomes = 0, new_boots = 0, downs = 0;
  std::set<std::int64_t> sent_blocks, arrived_blocks;
  std::int64_t recorded_by_device = 0;
  imrig_status status = {};

 private:
  bool chance(double p) { return std::uniform_real_distribution<>(0, 1)(random_) < p; }

  // Returns how often it arrived intact.
  template <class Deliver>
  int carry(const Bytes& packet, Deliver deliver) {
    int intact = 0;
    const int copies = chance(faults_.doubled) ? 2 : 1;
    for (int k = 0; k < copies && connected; ++k) {
      if (chance(faults_.lost)) continue;
      Bytes arrived = packet;
      if (chance(faults_.flipped)) {
        arrived[random_() % arrived.size()] ^= static_cast<std::uint8_t>(1u << (random_() % 8));
      } else {
        ++intact;
      }
      deliver(arrived);
    }
    return intact;
  }

  void tell() {
    Bytes frame(IMRIG_FRAME_MAX);
    while (const std::size_t n = imrig_device_take(bench.device.get(), frame.data(), frame.size())) {
      const Bytes packet(frame.begin(), frame.begin() + static_cast<std::ptrdiff_t>(n));
      Heard sent;
      FrameReader().feed(packet, [&](auto payload) { hear(payload, sent); });
      const int intact = carry(packet, [&](const Bytes& bytes) { host.receive(bytes, now_us); });
      for (const imrig_block& block : sent.blocks) {
        sent_blocks.insert(block.seq);
        if (intact > 0) arrived_blocks.insert(block.seq);
        if (block.record == 7) recorded_by_device += block.n;
      }
    }
  }

  void collect() {
    while (auto event = host.next_event()) {
      if (const auto* answer = std::get_if<LinkAnswer>(&*event))
        answers[answer->request].push_back(answer->result);
      if (const auto* block = std::get_if<LinkBlock>(&*event)) blocks.push_back(*block);
      if (const auto* told = std::get_if<LinkStatus>(&*event)) status = told->message;
      if (const auto* welcome = std::get_if<LinkWelcome>(&*event)) {
        if (welcomes++ == 0) first_block = welcome->message.next_block;
        new_boots += welcome->new_boot;
      }
      downs += std::holds_alternative<LinkDown>(*event);
    }
  }

  Faults faults_;
  std::mt19937 random_;
};

LinkProfile long_profile(std::int32_t profile_id, std::int32_t at_end) {
  LinkProfile profile;
  profile.profile_id = profile_id;
  profile.at_end = at_end;
  for (int k = 0; k < 24; ++k)
    profile.segments.push_back(voltage_segment(100, 2.0 * k, 2.0 * k + 2.0, k, k + 1));
  profile.segments[10].record = 7;
  return profile;
}

TEST(HostAndDevice, OnAGoodWireUploadStartHoldAndStop) {
  Pair pair(1, {});
  ASSERT_TRUE(pair.run_until([&] { return pair.host.up(); }, 100));
  const auto upload = pair.host.upload(long_profile(5, IMRIG_AT_END_HOLD));
  ASSERT_TRUE(pair.run_until([&] { return pair.answered(upload); }, 100));
  EXPECT_EQ(pair.answers[upload], std::vector<std::int32_t>{IMRIG_DONE});
  const auto start = pair.host.start(5);
  ASSERT_TRUE(pair.run_until([&] { return pair.status.state == IMRIG_HOLDING; }, 1000));
  EXPECT_EQ(pair.answers[start], std::vector<std::int32_t>{IMRIG_DONE});
  EXPECT_EQ(pair.status.profile_id, 5);
  const auto stop = pair.host.stop(0.01);
  ASSERT_TRUE(pair.run_until([&] { return pair.answered(stop) && pair.status.state == IMRIG_IDLE; }, 1000));
  EXPECT_EQ(pair.recorded_by_device, 100);
  EXPECT_EQ(pair.host.lost_blocks(), 0);
  EXPECT_EQ(pair.host.bad_frames(), 0);
  EXPECT_EQ(pair.bench.device->bad_frames, 0);
  std::int64_t next = pair.blocks.front().message.first_index;
  for (const auto& block : pair.blocks) {
    EXPECT_EQ(block.message.first_index, next);
    next += block.message.n;
  }
  EXPECT_EQ(pair.host.next_index(), next);
}

class BadWire : public testing::TestWithParam<unsigned> {};
INSTANTIATE_TEST_SUITE_P(Seeds, BadWire, testing::Range(1u, 9u));

TEST_P(BadWire, StillUploadsStartsOnceAndCountsWhatWasLost) {
  Pair pair(GetParam(), {0.20, 0.10, 0.05});
  ASSERT_TRUE(pair.run_until([&] { return pair.host.up(); }, 5000));
  const auto upload = pair.host.upload(long_profile(5, IMRIG_AT_END_GATES_OFF));
  ASSERT_TRUE(pair.run_until([&] { return pair.answered(upload); }, 10000));
  ASSERT_EQ(pair.answers[upload], std::vector<std::int32_t>{IMRIG_DONE});
  const auto start = pair.host.start(5);
  ASSERT_TRUE(pair.run_until([&] { return pair.answered(start); }, 10000));
  EXPECT_EQ(pair.answers[start], std::vector<std::int32_t>{IMRIG_DONE});
  pair.run_ms(2000);
  EXPECT_EQ(pair.recorded_by_device, 100) << "started not once";
  EXPECT_EQ(pair.bench.device->state, IMRIG_IDLE);

  ASSERT_FALSE(pair.arrived_blocks.empty());
  const std::int64_t last = *pair.arrived_blocks.rbegin();
  const auto from_first = [&](const std::set<std::int64_t>& blocks) {
    return std::distance(blocks.lower_bound(pair.first_block), blocks.upper_bound(last));
  };
  EXPECT_EQ(pair.host.lost_blocks(), from_first(pair.sent_blocks) - from_first(pair.arrived_blocks));
  EXPECT_GT(pair.host.lost_blocks(), 20);
  EXPECT_EQ(static_cast<std::ptrdiff_t>(pair.blocks.size()), from_first(pair.arrived_blocks));  // none twice
  EXPECT_GT(pair.host.bad_frames(), 0);
}

TEST_P(BadWire, TripGetsThroughAndNothingStartsBehindIt) {
  Pair pair(100 + GetParam(), {0.4, 0.2, 0.1});
  ASSERT_TRUE(pair.run_until([&] { return pair.host.up(); }, 10000));
  const auto upload = pair.host.upload(long_profile(5, IMRIG_AT_END_HOLD));
  ASSERT_TRUE(pair.run_until([&] { return pair.answered(upload); }, 20000));
  const auto start = pair.host.start(5);
  pair.run_ms(static_cast<int>(GetParam()) * 7);
  const auto trip = pair.host.trip();
  ASSERT_TRUE(pair.run_until([&] { return pair.answered(trip); }, 10000));
  EXPECT_EQ(pair.answers[trip], std::vector<std::int32_t>{IMRIG_DONE});
  ASSERT_TRUE(pair.run_until([&] { return pair.answered(start); }, 10000));
  pair.run_ms(500);
  EXPECT_EQ(pair.bench.device->state, IMRIG_TRIPPED);
  EXPECT_EQ(pair.bench.device->trip, IMRIG_TRIP_ORDERED);
  EXPECT_EQ(pair.bench.device->drive.command.legs, 0u);
}

TEST(HostAndDevice, AWireThatBreaksTripsTheDeviceAndTheHostComesBack) {
  Pair pair(3, {});
  ASSERT_TRUE(pair.run_until([&] { return pair.host.up(); }, 100));
  const auto upload = pair.host.upload(long_profile(5, IMRIG_AT_END_HOLD));
  ASSERT_TRUE(pair.run_until([&] { return pair.answered(upload); }, 100));
  pair.host.start(5);
  ASSERT_TRUE(pair.run_until([&] { return pair.status.state == IMRIG_HOLDING; }, 1000));
  pair.connected = false;
  const auto stop = pair.host.stop(0.1);
  ASSERT_TRUE(pair.run_until([&] { return pair.downs == 1; }, 3000));
  EXPECT_EQ(pair.answers[stop], std::vector<std::int32_t>{kLinkLost});
  EXPECT_FALSE(pair.host.up());
  pair.run_ms(1500);
  EXPECT_EQ(pair.bench.device->trip, IMRIG_TRIP_WATCHDOG);
  pair.connected = true;
  ASSERT_TRUE(pair.run_until([&] { return pair.host.up(); }, 1000));
  EXPECT_EQ(pair.new_boots, 1);
  EXPECT_EQ(pair.welcomes, 2);
  ASSERT_TRUE(pair.run_until([&] { return pair.status.trip == IMRIG_TRIP_WATCHDOG; }, 1000));
  const auto clear = pair.host.clear();
  ASSERT_TRUE(pair.run_until([&] { return pair.answered(clear) && pair.status.state == IMRIG_IDLE; }, 1000));
}

TEST(HostAndDevice, AHostThatComesBackAfterAnotherOneGoesOnFromWhereTheDeviceIs) {
  Pair pair(5, {});
  ASSERT_TRUE(pair.run_until([&] { return pair.host.up(); }, 100));
  pair.run_ms(200);
  pair.bench.now_ms = pair.now_us / 1000 + 2100;
  imrig_device_tick(pair.bench.device.get(), pair.bench.now_ms);
  pair.bench.hello(999);  // another host, for 100,000 samples
  pair.bench.samples(100000);
  ASSERT_EQ(pair.bench.device->host.host_nonce, 999);
  pair.now_us += 6000000;
  ASSERT_TRUE(pair.run_until([&] { return pair.welcomes == 2; }, 1000));
  EXPECT_EQ(pair.new_boots, 1);
  pair.run_ms(100);
  EXPECT_GT(pair.host.next_index(), 100000);
  EXPECT_GT(pair.bench.device->until_index, pair.host.next_index());
  EXPECT_GT(pair.host.lost_blocks(), 300);  // what the other one got
}

TEST(HostAndDevice, ARebootOfTheDeviceIsSeenAndItsBlocksCountAnew) {
  Pair pair(4, {});
  ASSERT_TRUE(pair.run_until([&] { return pair.host.up(); }, 100));
  pair.run_ms(200);
  imrig_device_config config = bench_config();
  config.boot_id = 4712;
  pair.bench = DeviceBench(config);
  ASSERT_TRUE(pair.run_until([&] { return pair.new_boots == 2; }, 3000));
  pair.run_ms(200);
  EXPECT_EQ(pair.host.welcome()->boot_id, 4712);
  EXPECT_EQ(pair.host.lost_blocks(), 0);
  EXPECT_EQ(pair.host.next_index(), pair.blocks.back().message.first_index + 256);
}

TEST(LinkHost, AnswersAtOnceWhatItCannotSend) {
  LinkHost host(host_config(9));
  const std::int64_t requests[] = {host.upload(long_profile(1, 0)), host.start(1), host.stop(1.0),
                                   host.trip(), host.clear()};
  for (const std::int64_t request : requests) {
    const auto event = host.next_event();
    ASSERT_TRUE(event && std::holds_alternative<LinkAnswer>(*event));
    EXPECT_EQ(std::get<LinkAnswer>(*event).request, request);
    EXPECT_EQ(std::get<LinkAnswer>(*event).result, kLinkLost);
  }
}

TEST(LinkHost, AnUploadThatTheDeviceRefusesEndsWithItsReason) {
  Pair pair(6, {});
  ASSERT_TRUE(pair.run_until([&] { return pair.host.up(); }, 100));
  LinkProfile profile = long_profile(5, 0);
  profile.segments[20].amplitude_end_V = 500.0;
  const auto upload = pair.host.upload(profile);
  ASSERT_TRUE(pair.run_until([&] { return pair.answered(upload); }, 1000));
  EXPECT_EQ(pair.answers[upload], std::vector<std::int32_t>{IMRIG_OVER_LIMIT});
  const auto empty = pair.host.upload(LinkProfile{});
  ASSERT_TRUE(pair.run_until([&] { return pair.answered(empty); }, 10));
  EXPECT_EQ(pair.answers[empty], std::vector<std::int32_t>{IMRIG_MALFORMED});
}

TEST(LinkHost, GivesUpOnADeviceThatNeverAnswersARequest) {
  LinkHostConfig config = host_config(6);
  config.give_up_us = 300000;
  LinkHost host(config);
  imrig_welcome welcome = {};
  welcome.host_nonce = config.host_nonce;
  const Bytes frame = frame_of(imrig_encode_welcome, welcome);
  host.receive(frame, 1000);
  const auto start = host.start(1);
  std::optional<LinkAnswer> answer;
  int sent = 0;
  for (std::int64_t t = 1000; t < 900000 && !answer; t += 10000) {
    host.receive(frame, t);  // alive, but mute
    host.poll(t);
    for (Bytes packet; host.next_output(packet);) {
      FrameReader().feed(packet,
                         [&](auto p) { sent += imrig_type_of(p.data(), p.size()) == IMRIG_TYPE_ORDER; });
    }
    while (auto event = host.next_event()) {
      if (const auto* told = std::get_if<LinkAnswer>(&*event)) answer = *told;
    }
  }
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->request, start);
  EXPECT_EQ(answer->result, kLinkNoAnswer);
  EXPECT_GE(sent, 5);
  EXPECT_LE(sent, 8);
}

TEST(LinkHost, NeverGrantsMoreThanTheSocketBufferHolds) {
  Pair pair(8, {});
  ASSERT_TRUE(pair.run_until([&] { return pair.host.up(); }, 100));
  pair.run_ms(1000);
  const std::int64_t ahead = pair.bench.device->until_index - pair.host.next_index();
  EXPECT_GT(ahead, 30 * 256);
  EXPECT_LE(ahead, 32 * 256);
}

}  // namespace
}  // namespace imrig::test
