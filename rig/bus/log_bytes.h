#pragma once
// The 28 bytes in front of every event of a log, shared by reader and writer.

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "rig/bus/event_log.h"

namespace imrig {

inline constexpr std::uint32_t kLogSync = 0xEDA1DA01;
inline constexpr std::size_t kLogHeaderBytes = 4 + 8 + 8 + 4 + 4;

struct LogHeader {
  std::int64_t number = 0;
  std::int64_t utime = 0;
  std::int32_t channel_bytes = 0;
  std::int32_t data_bytes = 0;
  std::int64_t event_bytes() const {
    return static_cast<std::int64_t>(kLogHeaderBytes) + channel_bytes + data_bytes;
  }
};

inline std::uint64_t read_big_endian(const std::uint8_t* at, std::size_t bytes) {
  std::uint64_t value = 0;
  for (std::size_t k = 0; k < bytes; ++k) value = (value << 8) | at[k];
  return value;
}

inline void put_big_endian(std::uint8_t* at, std::uint64_t value, std::size_t bytes) {
  for (std::size_t k = 0; k < bytes; ++k) at[k] = static_cast<std::uint8_t>(value >> (8 * (bytes - 1 - k)));
}

inline bool is_log_sync(const std::uint8_t* at) { return read_big_endian(at, 4) == kLogSync; }

// Nothing when these bytes cannot start an event: no sync word, or a length out of bounds.
inline std::optional<LogHeader> parse_log_header(const std::uint8_t* at) {
  if (!is_log_sync(at)) return std::nullopt;
  LogHeader header;
  header.number = static_cast<std::int64_t>(read_big_endian(at + 4, 8));
  header.utime = static_cast<std::int64_t>(read_big_endian(at + 12, 8));
  header.channel_bytes = static_cast<std::int32_t>(read_big_endian(at + 20, 4));
  header.data_bytes = static_cast<std::int32_t>(read_big_endian(at + 24, 4));
  if (header.channel_bytes < 1 || header.channel_bytes > kMaxChannelBytes) return std::nullopt;
  if (header.data_bytes < 0 || header.data_bytes > kMaxEventBytes) return std::nullopt;
  return header;
}

inline std::array<std::uint8_t, kLogHeaderBytes> make_log_header(const LogHeader& header) {
  std::array<std::uint8_t, kLogHeaderBytes> bytes = {};
  put_big_endian(bytes.data(), kLogSync, 4);
  put_big_endian(bytes.data() + 4, static_cast<std::uint64_t>(header.number), 8);
  put_big_endian(bytes.data() + 12, static_cast<std::uint64_t>(header.utime), 8);
  put_big_endian(bytes.data() + 20, static_cast<std::uint64_t>(header.channel_bytes), 4);
  put_big_endian(bytes.data() + 24, static_cast<std::uint64_t>(header.data_bytes), 4);
  return bytes;
}

}  // namespace imrig
