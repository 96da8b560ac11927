// Whatever comes over the wire, the device neither crashes nor drives beyond its limits.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "tests/rig/link/device_bench.h"

namespace imrig::test {
namespace {

void must(bool holds) {
  if (!holds) std::abort();
}

// The bytes are payloads, each led by its length: a fuzzer would never guess a CRC. What remains is fed as it
// is.
std::vector<std::uint8_t> stream_of(const std::uint8_t* data, std::size_t size) {
  std::vector<std::uint8_t> stream;
  std::size_t at = 0;
  while (at + 2 <= size) {
    const std::size_t n = (static_cast<std::size_t>(data[at]) << 8) | data[at + 1];
    if (n > size - at - 2 || n > IMRIG_PAYLOAD_MAX) break;
    std::vector<std::uint8_t> payload(data + at + 2, data + at + 2 + n), frame(IMRIG_FRAME_MAX);
    payload.resize(n + IMRIG_CRC_BYTES);
    frame.resize(imrig_frame_write(payload.data(), n, frame.data(), frame.size()));
    stream.insert(stream.end(), frame.begin(), frame.end());
    at += 2 + n;
  }
  stream.insert(stream.end(), data + at, data + size);
  return stream;
}

template <class Message>
void add(std::vector<std::uint8_t>& to, std::size_t (*encode)(const Message*, std::uint8_t*, std::size_t),
         const Message& m) {
  std::vector<std::uint8_t> payload(IMRIG_PAYLOAD_MAX);
  payload.resize(encode(&m, payload.data(), payload.size()));
  to.push_back(static_cast<std::uint8_t>(payload.size() >> 8));
  to.push_back(static_cast<std::uint8_t>(payload.size()));
  to.insert(to.end(), payload.begin(), payload.end());
}

std::vector<std::uint8_t> session(imrig_segment segment) {
  std::vector<std::uint8_t> bytes;
  add(bytes, imrig_encode_hello, bench_hello());
  segment.seq = 2;
  segment.profile_id = 1;
  add(bytes, imrig_encode_segment, segment);
  add(bytes, imrig_encode_commit, imrig_commit{0, 3, 1, 1, 1, IMRIG_AT_END_HOLD});
  add(bytes, imrig_encode_order, imrig_order{0, 4, 1, IMRIG_START, 1, 0.0});
  add(bytes, imrig_encode_credit, imrig_credit{0, 5, 1, 10000});
  return bytes;
}

}  // namespace
}  // namespace imrig::test

std::vector<std::vector<std::uint8_t>> fuzz_corpus() {
  using namespace imrig::test;
  imrig_segment current = off_segment(50), dc = off_segment(50);
  current.kind = IMRIG_CURRENT;
  current.offset_A = 3.0;
  current.n_tones = 2;
  current.tone_A[0] = 2.0;
  current.tone_Hz[0] = 12.0;
  current.kp_V_per_A = 1.6;
  current.ki_V_per_As = 116.0;
  current.period_samples = 5;
  dc.kind = IMRIG_DC;
  dc.plus_phases = 1;
  dc.minus_phases = 6;
  dc.level_A = 5.0;
  std::vector<std::vector<std::uint8_t>> corpus = {session(voltage_segment(50, 0, 200, 0, 60)),
                                                   session(current), session(dc), session(off_segment(10))};
  auto stopped = corpus[0];
  add(stopped, imrig_encode_order, imrig_order{0, 6, 1, IMRIG_STOP, 0, 0.01});
  corpus.push_back(stopped);
  add(stopped, imrig_encode_order, imrig_order{0, 7, 1, IMRIG_TRIP, 0, 0.0});
  add(stopped, imrig_encode_order, imrig_order{0, 8, 1, IMRIG_CLEAR, 0, 0.0});
  corpus.push_back(stopped);
  return corpus;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace imrig::test;
  DeviceBench bench;
  bench.hello();
  const auto stream = stream_of(data, size);
  for (std::size_t at = 0; at < stream.size(); at += 97) {
    const std::size_t n = std::min<std::size_t>(97, stream.size() - at);
    bench.feed({stream.begin() + static_cast<std::ptrdiff_t>(at),
                stream.begin() + static_cast<std::ptrdiff_t>(at + n)});
    for (const auto& command : bench.samples(20)) {
      must(command.legs <= IMRIG_ALL_LEGS);
      for (const double v : command.v_V) must(std::abs(v) <= bench.device->host.voltage_limit_V * 1.0000001);
    }
    bench.tick(bench.now_ms + 1);
  }
  must(bench.heard.other == 0 &&
       bench.reader.bad_frames() == 0);  // what the device says is well-formed, whatever it heard
  for (const auto& status : bench.heard.statuses) must(status.state >= 0 && status.state <= 4);
  return 0;
}
