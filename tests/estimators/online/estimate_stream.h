#pragma once
// The estimates of a log, as bytes, and the size of the stream of samples they come from.

#include <cstdint>
#include <string>
#include <vector>

#include "rig/bus/channels.h"
#include "rig/bus/event_log.h"

namespace imrig::test {

struct EstimateStream {
  std::vector<std::vector<std::uint8_t>> messages;  // ESTIMATE and MOTOR_ESTIMATE, in their order
  bool operator==(const EstimateStream&) const = default;
};

inline EstimateStream estimates_of(const std::string& log) {
  EstimateStream out;
  EventLogReader reader(log);
  LogEvent event;
  while (reader.next(event)) {
    if (event.channel.ends_with(std::string("_") + channel::kEstimate) ||
        event.channel.ends_with(std::string("_") + channel::kMotorEstimate))
      out.messages.push_back(event.data);
  }
  return out;
}

// FNV-1a over everything.
inline std::uint64_t hash_of(const EstimateStream& stream) {
  std::uint64_t h = 14695981039346656037ULL;
  for (const auto& message : stream.messages) {
    for (const std::uint8_t byte : message) h = (h ^ byte) * 1099511628211ULL;
  }
  return h;
}

}  // namespace imrig::test
