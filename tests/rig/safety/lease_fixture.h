#pragma once
// Lease tests without chance: ids counted up, time advanced by hand, both clocks together unless a test says
// otherwise.

#include <imrig_msg/heartbeat_t.hpp>

#include "rig/safety/lease_authority.h"
#include "rig/safety/lease_client.h"

namespace imrig {

inline constexpr std::int64_t kLease_us = 2'000'000;
inline constexpr std::int32_t kBridge = imrig_msg::heartbeat_t::BRIDGE;

inline LeaseAuthority::RandomId counting_ids(std::int64_t from = 1000) {
  return [next = from]() mutable { return ++next; };
}

inline Moment later(Moment now, std::int64_t by_us) { return {now.steady_us + by_us, now.wall_us + by_us}; }

inline constexpr Moment kStart = {5'000'000, 1'800'000'000'000'000};

inline imrig_msg::lease_cmd_t lease_request(const LeaseAuthority& authority, std::int32_t request,
                                            std::int64_t holder, std::int64_t seq, Moment now) {
  imrig_msg::lease_cmd_t cmd = {};
  cmd.lease_cmd_v1 = 1;
  cmd.seq = seq;
  cmd.authority = kBridge;
  cmd.request = request;
  cmd.holder = holder;
  cmd.challenge = authority.status(now).challenge;
  cmd.epoch = authority.epoch();
  cmd.issued_host_utime = now.wall_us;
  cmd.ttl_ms = 1000;
  return cmd;
}

}  // namespace imrig
