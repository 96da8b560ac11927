#pragma once
// May this command act? Only with the epoch of the current lease, only once, only in time. Everything else
// gets a reason. A command that carries the current epoch uses its sequence up, whatever the answer.

#include <cstdint>

#include "rig/safety/command_result.h"
#include "rig/safety/moment.h"

namespace imrig {

struct CommandStamp {
  std::int64_t epoch = 0;
  std::int64_t seq = 0;
  std::int64_t issued_wall_us = 0;
  std::int32_t ttl_ms = 0;
};

// Of a bridge_cmd_t or dyno_cmd_t.
template <class Command>
CommandStamp stamp_of(const Command& cmd) {
  return {cmd.lease_epoch, cmd.seq, cmd.issued_host_utime, cmd.ttl_ms};
}

inline constexpr std::int32_t kLongestTtl_ms = 60'000;

class CommandGuard {
 public:
  // lease_epoch: LeaseAuthority::epoch(), 0 when nobody holds the lease. Returns kDone when the command may
  // act, else kNoLease, kMalformed (ttl not in 1..60000 ms, seq < 1), kNotNew or kStale.
  CommandResult check(const CommandStamp& stamp, std::int64_t lease_epoch, Moment now);

 private:
  std::int64_t epoch_ = 0;
  std::int64_t last_seq_ = 0;
};

}  // namespace imrig
