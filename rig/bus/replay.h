#pragma once
// A log played back onto a bus: commands (names that end in _CMD) are left out, pace N or as fast as a
// bounded rate allows.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "rig/bus/bus.h"
#include "rig/bus/event_log.h"

namespace imrig {

// A process heard on the bus.
struct LiveProcess {
  std::int64_t instance = 0;
  std::int32_t process = 0;  // heartbeat_t's constants
  std::int32_t pid = 0;
  std::int32_t state = 0;
  std::string channel;  // in full, so the prefix shows
};

// "imrig-bridge", ... of heartbeat_t's constants.
std::string process_name(std::int32_t process);

// Listens for listen_ms of wall time, under any prefix: one entry an instance, in order of appearance.
// Heartbeats come every 200 ms. The bus keeps the subscription: use one opened for this alone.
std::vector<LiveProcess> live_heartbeats(Bus& bus, int listen_ms);

bool is_command_channel(std::string_view channel);

struct ReplayOptions {
  double speed = 1.0;                // log time over wall time; infinity: as fast as the rate allows
  double max_rate_per_s = 20000.0;   // messages; a burst above it is stretched, at any speed
  std::function<bool()> keep_going;  // asked often; empty: always
};

struct ReplayReport {
  std::int64_t played = 0;
  std::int64_t commands_left_out = 0;
  bool stopped = false;
};

// Publishes under full channel names, whatever their prefix.
using Player = std::function<void(const std::string& channel, Bytes data)>;
// On LCM's bus; subscribes to nothing. Throws Error as open_lcm_bus does.
Player open_lcm_player(const BusConfig& config);

// Publishes the rest of the log in its order.
ReplayReport replay(EventLogReader& log, const Player& publish, const ReplayOptions& options);

}  // namespace imrig
