#include "rig/safety/command_guard.h"

namespace imrig {

CommandResult CommandGuard::check(const CommandStamp& stamp, std::int64_t lease_epoch, Moment now) {
  if (lease_epoch == 0 || stamp.epoch != lease_epoch) return CommandResult::kNoLease;
  if (lease_epoch != epoch_) {
    epoch_ = lease_epoch;
    last_seq_ = 0;
  }
  if (stamp.seq < 1 || stamp.ttl_ms < 1 || stamp.ttl_ms > kLongestTtl_ms) return CommandResult::kMalformed;
  if (stamp.seq <= last_seq_) return CommandResult::kNotNew;
  last_seq_ = stamp.seq;
  return in_time(stamp.issued_wall_us, stamp.ttl_ms, now) ? CommandResult::kDone : CommandResult::kStale;
}

}  // namespace imrig
