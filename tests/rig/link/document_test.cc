// The worked examples of docs/dsp-link.md are what the code does.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "rig/link/frame_writer.h"
#include "tests/rig/link/device_bench.h"

namespace imrig::test {
namespace {

std::string document() {
  std::ifstream file(IMRIG_SOURCE_DIR "/docs/dsp-link.md");
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

// 16 bytes a line, as in the document.
std::string hex(const std::vector<std::uint8_t>& bytes) {
  std::string text;
  for (std::size_t k = 0; k < bytes.size(); ++k) {
    text += fmt::format("{:02X}{}", bytes[k], k % 16 == 15 || k + 1 == bytes.size() ? "\n" : " ");
  }
  return text;
}

template <class Message>
std::string payload_of(std::size_t (*encode)(const Message*, std::uint8_t*, std::size_t),
                       const Message& message) {
  std::vector<std::uint8_t> payload(IMRIG_PAYLOAD_MAX);
  payload.resize(encode(&message, payload.data(), payload.size()));
  return hex(payload);
}

TEST(Document, ShowsTheCreditFrameByteByByte) {
  const imrig_credit credit = {1000000, 7, 1, 16384};
  const std::string payload = payload_of(imrig_encode_credit, credit);
  const std::string frame = hex(frame_of(imrig_encode_credit, credit));
  EXPECT_NE(document().find(payload), std::string::npos) << payload;
  EXPECT_NE(document().find(frame), std::string::npos) << frame;
}

TEST(Document, ShowsTheHelloAndTheWelcomeThatAnswersIt) {
  imrig_hello hello = bench_hello(0x1122334455667788);
  hello.utime = 2000000;
  const std::string asked = hex(frame_of(imrig_encode_hello, hello));
  EXPECT_NE(document().find(asked), std::string::npos) << asked;
  DeviceBench bench;
  imrig_device_feed(bench.device.get(), frame_of(imrig_encode_hello, hello).data(),
                    frame_of(imrig_encode_hello, hello).size(), 0);
  std::vector<std::uint8_t> answer(IMRIG_FRAME_MAX);
  answer.resize(imrig_device_take(bench.device.get(), answer.data(), answer.size()));
  EXPECT_NE(document().find(hex(answer)), std::string::npos) << hex(answer);
}

TEST(Document, NamesEveryFingerprint) {
  for (int type = IMRIG_TYPE_HELLO; type <= IMRIG_TYPE_STATUS; ++type) {
    const std::string text = fmt::format("`{:016x}`", imrig_fingerprint(static_cast<imrig_type>(type)));
    EXPECT_NE(document().find(text), std::string::npos) << text;
  }
}

// A sample is 16 bytes; what a block and the statuses add is counted here as the document counts it.
TEST(Document, CountsTheBytesOnTheLineRight) {
  const auto block_frame = [](int n) {
    imrig_block block = {};
    block.n = n;
    for (int k = 0; k < n; ++k) block.i_a[k] = block.v_a[k] = 0x1234;
    return static_cast<double>(frame_of(imrig_encode_block, block).size());
  };
  const imrig_status status = {};
  const double status_bytes = static_cast<double>(frame_of(imrig_encode_status, status).size());
  const double bytes_per_s = (block_frame(256) / 256 / kSample_s) + 100 * status_bytes;
  const std::string text = fmt::format("{:.0f} kB/s", bytes_per_s * 1e-3);
  EXPECT_NE(document().find(text), std::string::npos)
      << text << ", block " << block_frame(256) << ", status " << status_bytes;
}

}  // namespace
}  // namespace imrig::test
