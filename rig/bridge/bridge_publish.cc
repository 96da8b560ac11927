// What the bridge tells the bus about itself: status at 20 Hz and at each change, lease at 10 Hz and at each
// change, heartbeat at 5 Hz.

#include <limits>
#include <utility>

#include "rig/bridge/bridge_core.h"

namespace imrig {

using imrig_msg::bridge_status_t;
using imrig_msg::heartbeat_t;

namespace {
constexpr std::int64_t kStatusPeriod_us = 50'000;
constexpr std::int64_t kLeasePeriod_us = 100'000;
constexpr std::int64_t kHeartbeatPeriod_us = 200'000;
}  // namespace

void BridgeCore::take_messages(const std::function<void(const BridgeMessage&)>& sink) {
  for (const BridgeMessage& message : messages_) sink(message);
  messages_.clear();
}

std::int64_t BridgeCore::rig_utime() const {
  const auto& welcome = link_.welcome();
  return welcome ? link_.next_index() * welcome->sample_time_ns / 1000 : 0;
}

std::int32_t BridgeCore::link_state() const {
  if (!link_.welcome()) return bridge_status_t::LINK_ABSENT;
  return link_.up() ? std::int32_t{bridge_status_t::LINK_UP} : std::int32_t{bridge_status_t::LINK_SILENT};
}

BridgeCore::Visible BridgeCore::visible() const {
  return {link_state(), drive_.state(), drive_.cause(), drive_.profile_id(), loaded_, last_};
}

void BridgeCore::publish_due(Moment now) {
  if (now.steady_us >= next_status_us_) publish_status(now, last_);
  if (now.steady_us >= next_lease_us_) publish_lease(now);
  if (now.steady_us >= next_heartbeat_us_) publish_heartbeat(now);
}

void BridgeCore::publish_if_changed(Moment now) {
  if (visible() == shown_) return;
  const bool health_changed = shown_.cause != drive_.cause() || shown_.link_state != link_state();
  publish_status(now, last_);
  if (health_changed) publish_heartbeat(now);
}

void BridgeCore::publish_status(Moment now, const LastCommand& last) {
  bridge_status_t status = {};
  status.utime = rig_utime();
  status.seq = ++status_seq_;
  status.bridge_status_v1 = 1;
  status.host_utime = now.wall_us;
  status.link_state = link_state();
  status.run_state = static_cast<std::int32_t>(drive_.state());
  status.trip = static_cast<std::int32_t>(drive_.cause());
  status.boot_id = link_.welcome() ? link_.welcome()->boot_id : 0;
  status.next_index = link_.next_index();
  status.lost_blocks = link_.lost_blocks();
  status.bad_frames = link_.bad_frames();
  status.profile_id = drive_.profile_id();
  status.profile_loaded = loaded_;
  const bool running =
      status.profile_id != 0 && drive_.device() && drive_.device()->profile_id == status.profile_id;
  status.segment = running ? drive_.device()->segment : -1;
  status.holding = drive_.state() == StopState::kHolding ? 1 : 0;
  status.last_cmd_epoch = last.epoch;
  status.last_cmd_seq = last.seq;
  status.last_cmd_result = static_cast<std::int32_t>(last.result);
  status.current_peak_A = std::exchange(current_peak_A_, 0.0);
  status.speed_rpm = extremes_.speed_rpm;
  status.stator_C = extremes_.stator_C;
  messages_.emplace_back(status);
  shown_ = visible();
  next_status_us_ = now.steady_us + kStatusPeriod_us;
}

void BridgeCore::publish_lease(Moment now) {
  imrig_msg::lease_t lease = lease_.status(now);
  lease.utime = rig_utime();
  lease.seq = ++lease_seq_;
  messages_.emplace_back(lease);
  next_lease_us_ = now.steady_us + kLeasePeriod_us;
}

void BridgeCore::publish_heartbeat(Moment now) {
  heartbeat_t heartbeat = {};
  heartbeat.utime = rig_utime();
  heartbeat.seq = ++heartbeat_seq_;
  heartbeat.heartbeat_v1 = 1;
  heartbeat.host_utime = now.wall_us;
  heartbeat.instance = instance_;
  heartbeat.process = heartbeat_t::BRIDGE;
  heartbeat.pid = pid_;
  heartbeat.state = link_.up() ? std::int32_t{heartbeat_t::OK} : std::int32_t{heartbeat_t::DEGRADED};
  if (drive_.state() == StopState::kTripped) heartbeat.state = heartbeat_t::TRIPPED;
  if (shut_down_us_) heartbeat.state = heartbeat_t::STOPPING;
  heartbeat.state_code = static_cast<std::int32_t>(drive_.cause());
  messages_.emplace_back(heartbeat);
  next_heartbeat_us_ = now.steady_us + kHeartbeatPeriod_us;
}

}  // namespace imrig
