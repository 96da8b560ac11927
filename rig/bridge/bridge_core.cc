#include "rig/bridge/bridge_core.h"

#include <algorithm>
#include <utility>

#include "rig/bridge/samples_of_block.h"

namespace imrig {

using imrig_msg::heartbeat_t;

namespace {

LinkHostConfig link_config(const LimitsConfig& limits, std::int64_t nonce) {
  LinkHostConfig config;
  config.host_nonce = nonce;
  config.watchdog_ms = limits.device_watchdog_ms;
  config.current_limit_A = limits.current_A;
  config.speed_limit_rpm = limits.speed_rpm;
  config.stator_limit_C = limits.stator_C;
  config.voltage_limit_V = limits.voltage_V;
  config.silence_us = std::int64_t{limits.link_silence_ms} * 1000;
  return config;
}

}  // namespace

BridgeCore::BridgeCore(const RigConfig& config, std::int32_t pid, LeaseAuthority::RandomId random_id)
    : config_(config),
      pid_(pid),
      instance_(random_id()),
      link_(link_config(config.limits, random_id())),
      drive_(link_),
      lease_(heartbeat_t::BRIDGE, std::int64_t{config.limits.lease_ms} * 1000, random_id),
      monitor_(config.limits),
      dyno_(heartbeat_t::DYNO, std::int64_t{config.limits.peer_silence_ms} * 1000),
      credit_(std::int64_t{config.bridge.credit_blocks} * IMRIG_BLOCK_SAMPLES) {}

// ---- from the link

void BridgeCore::on_link_bytes(std::span<const std::uint8_t> bytes, Moment now) {
  link_.receive(bytes, now.steady_us);
  take_link_events(now);
}

void BridgeCore::take_link_events(Moment now) {
  while (const auto event = link_.next_event()) {
    std::visit([&](const auto& what) { on_event(what, now); }, *event);
    settle_pending();
  }
  publish_if_changed(now);
}

void BridgeCore::on_event(const LinkWelcome& welcome, Moment) {
  drive_.on_welcome(welcome);
  if (!welcome.new_boot) return;
  credit_.new_boot(welcome.message.boot_id, welcome.message.next_index);
  lost_before_ = link_.lost_blocks();
  granted_ = 0;
  loaded_ = 0;
  extremes_ = {};
}

void BridgeCore::on_event(const LinkBlock& block, Moment) {
  auto samples = samples_of_block(block.message, *link_.welcome());
  extremes_ = monitor_.check(samples);
  current_peak_A_ = std::max(current_peak_A_, extremes_.current_A);
  if (extremes_.trip != Trip::kNone) drive_.trip(extremes_.trip);
  const auto lost = static_cast<double>(link_.lost_blocks() - lost_before_);
  if (drive_.may_drive() && lost > config_.limits.max_lost_blocks) drive_.trip(Trip::kSamplesLost);
  messages_.emplace_back(std::move(samples));
}

void BridgeCore::on_event(const LinkStatus& status, Moment) { drive_.on_status(status.message); }

void BridgeCore::on_event(const LinkAnswer& answer, Moment) {
  drive_.on_answer(answer);
  answer_pending(answer);
}

void BridgeCore::on_event(const LinkDown&, Moment) { drive_.on_down(); }

// ---- from the bus

void BridgeCore::on_lease_cmd(const imrig_msg::lease_cmd_t& cmd, Moment now) {
  watch_lease(now);
  if (!lease_.request(cmd, now)) return;
  watch_lease(now);
  publish_lease(now);
  publish_if_changed(now);
}

void BridgeCore::on_estop(const imrig_msg::estop_cmd_t&, Moment now) {
  drive_.trip(Trip::kOperatorStop);
  settle_pending();
  publish_if_changed(now);
}

void BridgeCore::on_heartbeat(const heartbeat_t& heartbeat, Moment now) {
  dyno_.on_heartbeat(heartbeat, now);
}

void BridgeCore::on_ack(const imrig_msg::ack_t& ack, Moment now) {
  credit_.on_ack(ack, now.steady_us);
  grant_credit(now, 1);
}

// ---- time

void BridgeCore::poll(Moment now) {
  watch_lease(now);
  watch_dyno(now);
  watch_shut_down(now);
  grant_credit(now, std::int64_t{config_.bridge.credit_blocks} * IMRIG_BLOCK_SAMPLES / 8);
  link_.poll(now.steady_us);
  take_link_events(now);
  drive_.poll(now.steady_us);
  settle_pending();
  link_.poll(now.steady_us);  // orders that the above gave leave at once
  publish_if_changed(now);
  publish_due(now);
}

void BridgeCore::watch_lease(Moment now) {
  if (lease_.step(now) == LeaseEnd::kNone) return;
  loaded_ = 0;  // the next holder uploads its own
  if (drive_.may_drive() && drive_.state() != StopState::kStopping) drive_.trip(Trip::kLeaseLost);
  settle_pending();
  if (pending_) pending_.reset();
  publish_lease(now);
  publish_if_changed(now);
}

void BridgeCore::watch_dyno(Moment now) {
  const Trip trip = dyno_.check(now, drive_.may_drive());
  if (trip != Trip::kNone) drive_.trip(trip);
  settle_pending();
}

void BridgeCore::grant_credit(Moment now, std::int64_t at_least) {
  if (!link_.up()) return;
  const std::int64_t horizon = credit_.horizon(link_.next_index(), now.steady_us);
  if (horizon < granted_ + at_least) return;
  granted_ = horizon;
  link_.grant(horizon);
}

void BridgeCore::shut_down(Moment now) {
  if (shut_down_us_) return;
  shut_down_us_ = now.steady_us;
  drive_.stop();
  publish_heartbeat(now);
}

void BridgeCore::watch_shut_down(Moment now) {
  if (shut_down_us_ && drive_.may_drive() && now.steady_us - *shut_down_us_ >= kShutDownRamp_us)
    drive_.trip(Trip::kStopTooLong);
}

bool BridgeCore::finished(Moment now) const {
  if (!shut_down_us_) return false;
  if (now.steady_us - *shut_down_us_ >= kShutDown_us || !link_.up()) return true;
  return !drive_.may_drive() && drive_.gates_known_off();
}

}  // namespace imrig
