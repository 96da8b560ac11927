#pragma once
// Finds frames in a byte stream: COBS up to a 0x00, CRC-32 over what it held (rig/link/device/frame.h).
// Bounded: whatever is longer than the longest frame is dropped and counted.

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace imrig {

class FrameReader {
 public:
  using Handler = std::function<void(std::span<const std::uint8_t> payload)>;
  // Calls handler with each whole, checked payload (the LCM-encoded struct without its CRC).
  void feed(std::span<const std::uint8_t> bytes, const Handler& handler);
  // Frames dropped for their length, COBS or CRC.
  std::int64_t bad_frames() const { return bad_frames_; }

 private:
  void end_frame(const Handler& handler);

  std::vector<std::uint8_t> frame_;
  bool overlong_ = false;
  std::int64_t bad_frames_ = 0;
};

}  // namespace imrig
