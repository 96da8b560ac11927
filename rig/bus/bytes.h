#pragma once
// A message as it came off the wire.

#include <cstdint>
#include <span>

namespace imrig {

using Bytes = std::span<const std::uint8_t>;

}  // namespace imrig
