#include "rig/bridge/credit_keeper.h"

#include <algorithm>
#include <imrig_msg/heartbeat_t.hpp>

namespace imrig {

namespace {
constexpr std::int64_t kAlive_us = 1'000'000;
constexpr std::size_t kMostFollowers = 64;  // whatever the bus says
}

void CreditKeeper::new_boot(std::int64_t boot_id, std::int64_t next_index) {
  boot_id_ = boot_id;
  horizon_ = 0;
  for (auto& [key, follower] : followers_) follower.read_index = next_index;
}

void CreditKeeper::on_ack(const imrig_msg::ack_t& ack, std::int64_t now_us) {
  if (ack.boot_id != boot_id_ || ack.process < imrig_msg::heartbeat_t::BRIDGE ||
      ack.process > imrig_msg::heartbeat_t::CAMPAIGN)
    return;
  const auto key = std::make_pair(ack.process, ack.pid);
  if (followers_.size() < kMostFollowers || followers_.contains(key)) followers_[key] = {ack.read_index, now_us};
}

std::int64_t CreditKeeper::horizon(std::int64_t next_index, std::int64_t now_us) {
  std::erase_if(followers_, [&](const auto& entry) { return now_us - entry.second.heard_us >= kAlive_us; });
  std::int64_t slowest = next_index;
  for (const auto& [key, follower] : followers_) slowest = std::min(slowest, follower.read_index);
  horizon_ = std::max(horizon_, std::max<std::int64_t>(slowest, 0) + window_);
  return horizon_;
}

}  // namespace imrig
