#include "rig/link/frame_reader.h"

#include <algorithm>

#include "rig/link/device/frame.h"

namespace imrig {

void FrameReader::feed(std::span<const std::uint8_t> bytes, const Handler& handler) {
  while (!bytes.empty()) {
    const auto end = std::find(bytes.begin(), bytes.end(), std::uint8_t{0});
    const auto piece = bytes.first(static_cast<std::size_t>(end - bytes.begin()));
    if (frame_.size() + piece.size() >= IMRIG_FRAME_MAX) {
      overlong_ = true;
      frame_.clear();
    } else if (!overlong_) {
      frame_.insert(frame_.end(), piece.begin(), piece.end());
    }
    if (end == bytes.end()) return;
    end_frame(handler);
    bytes = bytes.subspan(piece.size() + 1);
  }
}

void FrameReader::end_frame(const Handler& handler) {
  if (overlong_) {
    ++bad_frames_;
  } else if (!frame_.empty()) {  // zeros between frames are allowed
    const std::size_t n = imrig_frame_open(frame_.data(), frame_.size());
    if (n == 0) {
      ++bad_frames_;
    } else {
      handler(std::span<const std::uint8_t>(frame_.data(), n));
    }
  }
  overlong_ = false;
  frame_.clear();
}

}  // namespace imrig
