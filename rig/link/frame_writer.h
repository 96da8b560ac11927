#pragma once
// A message to the bytes of its frame, with the device's own encoders: frame_of(imrig_encode_hello, hello).

#include <cstddef>
#include <cstdint>
#include <vector>

#include "rig/link/device/codec.h"
#include "rig/link/device/frame.h"

namespace imrig {

// Empty when the message cannot be encoded (a block with an n out of range).
template <class Message>
std::vector<std::uint8_t> frame_of(std::size_t (*encode)(const Message*, std::uint8_t*, std::size_t),
                                   const Message& message) {
  std::vector<std::uint8_t> payload(IMRIG_PAYLOAD_MAX + IMRIG_CRC_BYTES);
  const std::size_t n = encode(&message, payload.data(), IMRIG_PAYLOAD_MAX);
  if (n == 0) return {};
  std::vector<std::uint8_t> frame(IMRIG_COBS_MAX(n + IMRIG_CRC_BYTES) + 2);
  frame.resize(imrig_frame_write(payload.data(), n, frame.data(), frame.size()));
  return frame;
}

}  // namespace imrig
