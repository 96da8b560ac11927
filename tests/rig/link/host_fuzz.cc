// Whatever comes over the wire, the host neither crashes nor hands on a block that is none.
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "rig/link/frame_writer.h"
#include "rig/link/host.h"

namespace {

imrig_welcome welcome() {
  imrig_welcome m = {};
  m.host_nonce = 5;
  m.boot_id = 6;
  m.sample_time_ns = 60000;
  return m;
}

std::vector<std::uint8_t> payload_of(const imrig_block& block) {
  std::vector<std::uint8_t> payload(IMRIG_PAYLOAD_MAX);
  payload.resize(imrig_encode_block(&block, payload.data(), payload.size()));
  return payload;
}

}  // namespace

// Payloads without CRC: the target adds it.
std::vector<std::vector<std::uint8_t>> fuzz_corpus() {
  std::vector<std::vector<std::uint8_t>> corpus;
  imrig_block block = {};
  for (const int n : {1, 3, 256}) {
    block.n = n;
    corpus.push_back(payload_of(block));
  }
  std::vector<std::uint8_t> bytes(200);
  const imrig_reply reply = {0, 0, 1, 3, 0};
  bytes.resize(imrig_encode_reply(&reply, bytes.data(), bytes.size()));
  corpus.push_back(bytes);
  bytes.resize(200);
  imrig_status status = {};
  status.boot_id = 6;
  bytes.resize(imrig_encode_status(&status, bytes.data(), bytes.size()));
  corpus.push_back(bytes);
  bytes.resize(200);
  const imrig_welcome again = welcome();
  bytes.resize(imrig_encode_welcome(&again, bytes.data(), bytes.size()));
  corpus.push_back(bytes);
  return corpus;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  imrig::LinkHostConfig config;
  config.host_nonce = 5;
  imrig::LinkHost host(config);
  host.receive(imrig::frame_of(imrig_encode_welcome, welcome()), 1000);
  host.upload({1, 0, std::vector<imrig_segment>(3)});
  host.start(1);
  host.poll(1000);
  if (size <= IMRIG_PAYLOAD_MAX && size > 0) {
    std::vector<std::uint8_t> payload(data, data + size), frame(IMRIG_FRAME_MAX);
    payload.resize(size + IMRIG_CRC_BYTES);
    frame.resize(imrig_frame_write(payload.data(), size, frame.data(), frame.size()));
    host.receive(frame, 2000);
  }
  host.receive({data, size}, 3000);
  host.poll(4000);
  while (auto event = host.next_event()) {
    const auto* block = std::get_if<imrig::LinkBlock>(&*event);
    if (block != nullptr && (block->message.n < 1 || block->message.n > 256 || block->lost_before < 0))
      std::abort();
  }
  std::vector<std::uint8_t> packet;
  while (host.next_output(packet)) {
    if (packet.size() > 1400) std::abort();
  }
  return 0;
}
