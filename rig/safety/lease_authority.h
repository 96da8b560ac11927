#pragma once
// Who may command an actuator: one holder at a time, for a limited time.
//
// The authority publishes a random challenge. A client that returns it gets the lease, if the lease is free:
// a new random epoch, which every command must carry. The challenge changes with every grant, release and
// expiry, and epochs are never used twice, so a recorded request, renewal or command is worthless. Expiry is
// measured on the steady clock: setting the wall clock prolongs nothing.

#include <cstdint>
#include <functional>
#include <imrig_msg/lease_cmd_t.hpp>
#include <imrig_msg/lease_t.hpp>

#include "rig/safety/moment.h"

namespace imrig {

enum class LeaseEnd { kNone, kReleased, kExpired };

class LeaseAuthority {
 public:
  using RandomId =
      std::function<std::int64_t()>;  // positive, never 0, never repeating: random_id of rig/base/clock.h

  // authority: heartbeat_t::BRIDGE or heartbeat_t::DYNO.
  LeaseAuthority(std::int32_t authority, std::int64_t lease_us, RandomId random_id);

  // A request as it came off the bus. Returns true when the lease changed (granted, renewed, released):
  // publish status() at once. Refused without a trace: another authority, wrong challenge or epoch, a
  // sequence not above the holder's last one, stale.
  bool request(const imrig_msg::lease_cmd_t& cmd, Moment now);

  // Lets time pass; call it at least every 20 ms and before anything that asks for the epoch.
  // Returns how the lease ended since the last call, by expiry or by release: while the rig runs, either is a
  // trip.
  LeaseEnd step(Moment now);

  bool held() const { return epoch_ != 0; }
  std::int64_t epoch() const { return epoch_; }    // 0 when nobody holds the lease
  std::int64_t holder() const { return holder_; }  // 0 when nobody holds the lease

  // For PREFIX_BRIDGE_LEASE or PREFIX_DYNO_LEASE; utime and seq are the caller's to fill.
  imrig_msg::lease_t status(Moment now) const;

 private:
  void end(LeaseEnd how);
  bool acquire(const imrig_msg::lease_cmd_t& cmd, Moment now);
  bool renew(const imrig_msg::lease_cmd_t& cmd, Moment now);

  std::int32_t authority_;
  std::int64_t lease_us_;
  RandomId random_id_;
  std::int64_t challenge_;
  std::int64_t epoch_ = 0;
  std::int64_t holder_ = 0;
  std::int64_t last_seq_ = 0;    // of the holder's requests
  std::int64_t renewed_us_ = 0;  // steady
  LeaseEnd ended_ = LeaseEnd::kNone;
};

}  // namespace imrig
