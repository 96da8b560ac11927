#include "rig/safety/lease_authority.h"

#include <algorithm>
#include <utility>

namespace imrig {

using imrig_msg::lease_cmd_t;

LeaseAuthority::LeaseAuthority(std::int32_t authority, std::int64_t lease_us, RandomId random_id)
    : authority_(authority),
      lease_us_(lease_us),
      random_id_(std::move(random_id)),
      challenge_(random_id_()) {}

bool LeaseAuthority::request(const lease_cmd_t& cmd, Moment now) {
  if (cmd.authority != authority_ || cmd.holder == 0) return false;
  if (!in_time(cmd.issued_host_utime, cmd.ttl_ms, now)) return false;
  if (held() && now.steady_us - renewed_us_ >= lease_us_) end(LeaseEnd::kExpired);
  switch (cmd.request) {
    case lease_cmd_t::ACQUIRE:
      return acquire(cmd, now);
    case lease_cmd_t::RENEW:
    case lease_cmd_t::RELEASE:
      return renew(cmd, now);
    default:
      return false;
  }
}

bool LeaseAuthority::acquire(const lease_cmd_t& cmd, Moment now) {
  if (held() || cmd.challenge != challenge_) return false;
  epoch_ = random_id_();
  challenge_ = random_id_();
  holder_ = cmd.holder;
  last_seq_ = cmd.seq;
  renewed_us_ = now.steady_us;
  return true;
}

bool LeaseAuthority::renew(const lease_cmd_t& cmd, Moment now) {
  if (!held() || cmd.epoch != epoch_ || cmd.holder != holder_ || cmd.seq <= last_seq_) return false;
  last_seq_ = cmd.seq;
  if (cmd.request == lease_cmd_t::RELEASE) {
    end(LeaseEnd::kReleased);
  } else {
    renewed_us_ = now.steady_us;
  }
  return true;
}

LeaseEnd LeaseAuthority::step(Moment now) {
  const bool backwards = now.steady_us < renewed_us_;
  if (held() && (backwards || now.steady_us - renewed_us_ >= lease_us_)) end(LeaseEnd::kExpired);
  return std::exchange(ended_, LeaseEnd::kNone);
}

void LeaseAuthority::end(LeaseEnd how) {
  epoch_ = 0;
  holder_ = 0;
  last_seq_ = 0;
  challenge_ = random_id_();
  ended_ = how;
}

imrig_msg::lease_t LeaseAuthority::status(Moment now) const {
  imrig_msg::lease_t lease = {};
  lease.lease_v1 = 1;
  lease.authority = authority_;
  lease.challenge = challenge_;
  lease.epoch = epoch_;
  lease.holder = holder_;
  const std::int64_t left_us = held() ? renewed_us_ + lease_us_ - now.steady_us : 0;
  lease.expires_in_ms = static_cast<std::int32_t>(std::max<std::int64_t>(left_us / 1000, 0));
  return lease;
}

}  // namespace imrig
