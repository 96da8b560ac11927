#include "rig/safety/lease_client.h"

namespace imrig {

using imrig_msg::lease_cmd_t;

namespace {
constexpr std::int64_t kRetry_us = 100'000;  // the authority publishes its challenge about so often
constexpr std::int32_t kTtl_ms = 1000;
}  // namespace

LeaseClient::LeaseClient(std::int32_t authority, std::int64_t holder, std::int64_t lease_us)
    : authority_(authority), holder_(holder), lease_us_(lease_us) {}

void LeaseClient::acquire() {
  wanted_ = true;
  lost_ = false;
  next_send_us_ = 0;
}

void LeaseClient::release() {
  wanted_ = false;
  lost_ = false;
  if (epoch_ != 0) release_epoch_ = epoch_;
  epoch_ = 0;
}

void LeaseClient::on_lease(const imrig_msg::lease_t& lease, Moment now) {
  if (lease.authority != authority_) return;
  challenge_ = lease.challenge;
  const bool ours = lease.epoch != 0 && lease.holder == holder_;
  other_holder_ = lease.epoch != 0 && !ours ? lease.holder : 0;
  if (held() && (!ours || lease.epoch != epoch_)) return lose();
  if (!ours || lease.epoch == released_epoch_) return;
  if (!held() && lease.epoch != release_epoch_) {
    if (!wanted_) {  // a grant that came after we changed our mind
      release_epoch_ = lease.epoch;
      return;
    }
    epoch_ = lease.epoch;
    next_send_us_ = now.steady_us + lease_us_ / 3;
  }
  good_until_us_ = now.steady_us + std::int64_t{lease.expires_in_ms} * 1000;
}

std::optional<lease_cmd_t> LeaseClient::step(Moment now) {
  if (release_epoch_ != 0) {
    lease_cmd_t cmd = make(lease_cmd_t::RELEASE, now);
    cmd.epoch = release_epoch_;
    released_epoch_ = release_epoch_;
    release_epoch_ = 0;
    return cmd;
  }
  if (held() && now.steady_us >= good_until_us_) lose();
  if (!wanted_ || lost_ || challenge_ == 0 || now.steady_us < next_send_us_) return std::nullopt;
  if (!held() && other_holder_ != 0) return std::nullopt;
  next_send_us_ = now.steady_us + (held() ? lease_us_ / 3 : kRetry_us);
  if (held()) {
    lease_cmd_t cmd = make(lease_cmd_t::RENEW, now);
    cmd.epoch = epoch_;
    return cmd;
  }
  lease_cmd_t cmd = make(lease_cmd_t::ACQUIRE, now);
  cmd.challenge = challenge_;
  return cmd;
}

void LeaseClient::lose() {
  epoch_ = 0;
  lost_ = true;
  wanted_ = false;
}

lease_cmd_t LeaseClient::make(std::int32_t request, Moment now) {
  lease_cmd_t cmd = {};
  cmd.seq = ++lease_seq_;
  cmd.lease_cmd_v1 = 1;
  cmd.authority = authority_;
  cmd.request = request;
  cmd.holder = holder_;
  cmd.issued_host_utime = now.wall_us;
  cmd.ttl_ms = kTtl_ms;
  return cmd;
}

}  // namespace imrig
