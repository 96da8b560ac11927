#pragma once
// The commander's side of a lease: ask with the current challenge, renew at a third of the lease time,
// release, know when it is lost. One object per authority. The caller publishes what step() returns on
// LEASE_CMD and hands every BRIDGE_LEASE or DYNO_LEASE to on_lease().
//
//   LeaseClient lease(heartbeat_t::BRIDGE, random_id(), limits.lease_ms * 1000);
//   lease.acquire();
//   every 20 ms: if (auto cmd = lease.step(now)) publish(bus, channel::kLeaseCmd, *cmd);
//   once lease.held(): bridge_cmd_t cmd = ...; lease.sign(cmd, now); publish(bus, channel::kBridgeCmd, cmd);
//   answered when status.last_cmd_epoch == cmd.lease_epoch && status.last_cmd_seq == cmd.seq &&
//   status.last_cmd_result != kPending.

#include <cstdint>
#include <imrig_msg/lease_cmd_t.hpp>
#include <imrig_msg/lease_t.hpp>
#include <optional>

#include "rig/safety/moment.h"

namespace imrig {

class LeaseClient {
 public:
  // holder: this client's own random id, one per process and start.
  LeaseClient(std::int32_t authority, std::int64_t holder, std::int64_t lease_us);

  void acquire();  // start wanting the lease; clears lost()
  void release();  // stop wanting it; step() sends the release if it was held

  void on_lease(const imrig_msg::lease_t& lease, Moment now);
  // What to publish now, if anything. Call it at least every 50 ms.
  std::optional<imrig_msg::lease_cmd_t> step(Moment now);

  bool held() const { return epoch_ != 0; }
  // It was held, was not released, and is gone (expired, authority restarted or silent). Stays until
  // acquire().
  bool lost() const { return lost_; }
  std::int64_t epoch() const { return epoch_; }  // 0 unless held
  std::int64_t holder() const { return holder_; }
  std::int64_t other_holder() const {
    return other_holder_;
  }  // somebody else holds it: their id; 0 if free or ours

  // Fills lease_epoch, seq (strictly rising), issued_host_utime and ttl_ms of a bridge_cmd_t or dyno_cmd_t.
  template <class Command>
  void sign(Command& cmd, Moment now, std::int32_t ttl_ms = 1000) {
    cmd.lease_epoch = epoch_;
    cmd.seq = ++command_seq_;
    cmd.issued_host_utime = now.wall_us;
    cmd.ttl_ms = ttl_ms;
  }

 private:
  void lose();
  imrig_msg::lease_cmd_t make(std::int32_t request, Moment now);

  std::int32_t authority_;
  std::int64_t holder_;
  std::int64_t lease_us_;
  bool wanted_ = false;
  bool lost_ = false;
  std::int64_t challenge_ = 0;  // 0: none heard yet
  std::int64_t epoch_ = 0;
  std::int64_t release_epoch_ = 0;   // to be released with the next step; 0 none
  std::int64_t released_epoch_ = 0;  // already given back: a late status must not revive it
  std::int64_t other_holder_ = 0;
  std::int64_t good_until_us_ = 0;  // steady: the lease surely lasts no longer
  std::int64_t next_send_us_ = 0;   // steady: the next renewal or request
  std::int64_t lease_seq_ = 0;
  std::int64_t command_seq_ = 0;
};

}  // namespace imrig
