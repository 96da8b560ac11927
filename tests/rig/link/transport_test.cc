// Host core and device over the real wires: UDP and a pair of pseudo-terminals.
#include "rig/link/transport.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <set>

#include "rig/base/clock.h"
#include "rig/base/error.h"
#include "rig/link/host.h"
#include "tests/rig/link/device_bench.h"
#include "tests/rig/link/serial_line.h"

namespace imrig::test {
namespace {

using testing::HasSubstr;
using Bytes = std::vector<std::uint8_t>;

std::string why(const std::string& url) {
  try {
    open_transport(url);
  } catch (const Error& e) {
    return e.what();
  }
  return "opened";
}

TEST(Transport, SaysInOneSentenceWhatIsWrongWithItsAddress) {
  EXPECT_THAT(why("udp://127.0.0.1"), HasSubstr("no port"));
  EXPECT_THAT(why("udp://127.0.0.1:0"), HasSubstr("port 0"));
  EXPECT_THAT(why("udp://127.0.0.1:99999"), HasSubstr("65535"));
  EXPECT_THAT(why("tcp://127.0.0.1:5"), HasSubstr("wanted is udp://"));
  EXPECT_THAT(why("udp:///dev/null"), HasSubstr("wanted is udp://"));
  EXPECT_THAT(why("udp://127.0.0.1:5?baud=9600"), HasSubstr("option 'baud' is unknown"));
  EXPECT_THAT(why("udp-listen://192.0.2.1:5000"), HasSubstr("address of this machine"));
  EXPECT_THAT(why("serial:///dev/no-such-line"), HasSubstr("No such file"));
  EXPECT_THAT(why("serial:///dev/null"), HasSubstr("no serial line"));
  EXPECT_THAT(why("serial:///dev/null?baud=12345"), HasSubstr("no such baud rate"));
  EXPECT_THAT(why("serial:///dev/null?parity=1"), HasSubstr("option 'parity' is unknown"));
  for (const char* url : {"udp://127.0.0.1", "serial:///dev/null", "tcp://127.0.0.1:5"}) {
    EXPECT_EQ(why(url).find('\n'), std::string::npos);
  }
}

TEST(Transport, SaysThatAPortIsInUse) {
  const auto first = open_transport("udp-listen://127.0.0.1:0");
  EXPECT_THAT(why("udp-listen://" + first->url().substr(6)), HasSubstr("the port is in use"));
}

TEST(Transport, ListeningAnswersOnlyWhomItAccepted) {
  const auto device = open_transport("udp-listen://127.0.0.1:0");
  const auto host = open_transport(device->url());
  const auto stranger = open_transport(device->url());
  std::array<std::uint8_t, 100> buffer;
  EXPECT_FALSE(device->write(Bytes{1}));  // to nobody
  ASSERT_TRUE(host->write(Bytes{1, 2, 3}));
  ASSERT_TRUE(device->wait(5000));
  EXPECT_EQ(device->read(buffer), 3u);
  EXPECT_TRUE(device->from_stranger());
  device->accept_sender();
  ASSERT_TRUE(stranger->write(Bytes{4}));
  ASSERT_TRUE(device->wait(5000));
  EXPECT_EQ(device->read(buffer), 1u);
  EXPECT_TRUE(device->from_stranger());
  ASSERT_TRUE(device->write(Bytes{5, 6}));
  ASSERT_TRUE(host->wait(5000));
  EXPECT_EQ(host->read(buffer), 2u);
  EXPECT_FALSE(stranger->wait(50));
}

TEST(Transport, ToNobodyIsNoFault) {
  std::string url;
  { url = open_transport("udp-listen://127.0.0.1:0")->url(); }
  const auto host = open_transport(url);
  std::array<std::uint8_t, 100> buffer;
  for (int k = 0; k < 5; ++k) {
    host->write(Bytes{1});
    host->wait(10);
    EXPECT_EQ(host->read(buffer), 0u);
  }
}

// Uploads, starts, takes blocks until the profile is over; the device waits for credit, so nothing may be
// lost, however slow the machine is.
void upload_and_run(Transport& device_side, Transport& host_side) {
  imrig_device_config config = bench_config();
  config.waits_for_credit = 1;
  DeviceBench bench(config);
  LinkHostConfig host_config;
  host_config.host_nonce = 77;
  host_config.watchdog_ms = 2000;
  host_config.current_limit_A = host_config.speed_limit_rpm = host_config.stator_limit_C = 1000;
  host_config.voltage_limit_V = 230;
  LinkHost host(host_config);
  LinkProfile profile;
  profile.profile_id = 3;
  for (int k = 0; k < 24; ++k) profile.segments.push_back(voltage_segment(1000 + k, 10, 20, 10, 10));
  std::int64_t upload = 0, start = 0, samples = 0;
  std::set<std::int32_t> segments;
  bool over = false;
  std::vector<std::uint8_t> buffer(65536), frame(IMRIG_FRAME_MAX), packet;
  const auto deadline = monotonic_us() + 60000000;
  while (!over && monotonic_us() < deadline) {
    while (const std::size_t n = device_side.read(buffer)) {
      bench.now_ms = monotonic_us() / 1000;
      bench.feed({buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(n)});
      if (device_side.from_stranger()) device_side.accept_sender();
    }
    for (int k = 0; k < 256 && imrig_device_may_sample(bench.device.get()); ++k) {
      imrig_device_sample(bench.device.get(), &bench.counts);
    }
    while (const std::size_t n = imrig_device_take(bench.device.get(), frame.data(), frame.size())) {
      ASSERT_TRUE(device_side.write({frame.data(), n}));
    }
    while (const std::size_t n = host_side.read(buffer)) host.receive({buffer.data(), n}, monotonic_us());
    while (auto event = host.next_event()) {
      if (std::holds_alternative<LinkWelcome>(*event)) upload = host.upload(profile);
      if (const auto* answer = std::get_if<LinkAnswer>(&*event)) {
        ASSERT_EQ(answer->result, IMRIG_DONE);
        if (answer->request == upload) start = host.start(3);
      }
      if (const auto* block = std::get_if<LinkBlock>(&*event)) {
        samples += block->message.n;
        if (block->message.segment >= 0) segments.insert(block->message.segment);
        over = segments.size() == 24 && block->message.segment < 0;
      }
    }
    host.grant(host.next_index() + 2 * 256);  // little enough for a pseudo-terminal's buffer
    host.poll(monotonic_us());
    while (host.next_output(packet)) ASSERT_TRUE(host_side.write(packet));
    host_side.wait(1);
  }
  EXPECT_TRUE(over);
  EXPECT_GT(start, 0);
  EXPECT_EQ(samples, host.next_index());
  EXPECT_EQ(host.lost_blocks(), 0);
  EXPECT_EQ(host.bad_frames(), 0);
  EXPECT_EQ(bench.device->bad_frames, 0);
}

TEST(Transport, CarriesAWholeProfileOverUdp) {
  const auto device_side = open_transport("udp-listen://127.0.0.1:0");
  const auto host_side = open_transport(device_side->url());
  upload_and_run(*device_side, *host_side);
}

TEST(Transport, CarriesAWholeProfileOverASerialLine) {
  SerialLine line;
  const auto device_side = open_transport("serial://" + line.names[0] + "?baud=3000000");
  const auto host_side = open_transport("serial://" + line.names[1] + "?baud=3000000");
  EXPECT_THAT(why("serial://" + line.names[1]), HasSubstr("in use"));
  upload_and_run(*device_side, *host_side);
}

}  // namespace
}  // namespace imrig::test
