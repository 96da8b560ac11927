#include "tests/rig/bridge/commander.h"

#include <sys/socket.h>

#include <imrig_msg/estop_cmd_t.hpp>

#include "rig/base/clock.h"
#include "rig/base/error.h"
#include "rig/bus/channels.h"
#include "tests/support/free_port.h"

namespace imrig {

using imrig_msg::bridge_cmd_t;
using imrig_msg::bridge_status_t;
using imrig_msg::heartbeat_t;
using imrig_msg::segment_t;

namespace {

Moment now() { return {monotonic_us(), wall_us()}; }

}  // namespace

RigConfig test_rig(const std::string& link_url) {
  RigConfig rig;
  rig.bus.url = "udpm://239.255.76.77:" + std::to_string(test::free_port(SOCK_DGRAM)) + "?ttl=0";
  rig.bridge.link = link_url;
  rig.limits.device_watchdog_ms = 1500;  // these machines sleep now and then
  rig.limits.link_silence_ms = 2000;
  rig.limits.lease_ms = 3000;
  return rig;
}

Commander::Commander(const RigConfig& rig)
    : bus(open_lcm_bus(rig.bus)),
      lease(heartbeat_t::BRIDGE, random_id(), std::int64_t{rig.limits.lease_ms} * 1000) {
  subscribe<imrig_msg::lease_t>(*bus, channel::kBridgeLease,
                                [this](const auto& m) { lease.on_lease(m, now()); });
  subscribe<heartbeat_t>(*bus, channel::kHeartbeat, [this](const auto& m) {
    if (m.process == heartbeat_t::BRIDGE) heartbeat = m;
  });
  subscribe<bridge_status_t>(*bus, channel::kBridgeStatus, [this](const auto& m) {
    status_ = m;
    const auto result = static_cast<CommandResult>(m.last_cmd_result);
    if (awaited_ == std::pair(m.last_cmd_epoch, m.last_cmd_seq) && result != CommandResult::kPending)
      answer_ = result;
  });
}

void Commander::turn() {
  if (const auto cmd = lease.step(now())) publish(*bus, channel::kLeaseCmd, *cmd);
  bus->wait(5);
}

bool Commander::until(const std::function<bool()>& reached, int at_most_ms) {
  const std::int64_t end_us = monotonic_us() + std::int64_t{at_most_ms} * 1000;
  while (!reached() && monotonic_us() < end_us) turn();
  return reached();
}

bool Commander::take_lease() {
  lease.acquire();
  return until([this] { return lease.held(); });
}

CommandResult Commander::send(bridge_cmd_t& cmd, std::int32_t ttl_ms) {
  cmd.bridge_cmd_v1 = 1;
  lease.sign(cmd, now(), ttl_ms);
  answer_.reset();
  awaited_ = std::pair(cmd.lease_epoch, cmd.seq);
  publish(*bus, channel::kBridgeCmd, cmd);
  until([this] { return answer_.has_value(); });
  return answer_.value_or(CommandResult::kPending);
}

CommandResult Commander::act(std::int32_t action, std::int32_t profile_id) {
  bridge_cmd_t cmd = {};
  cmd.action = action;
  cmd.profile_id = profile_id;
  return send(cmd);
}

bool Commander::drive(std::int32_t profile_id) {
  if (!until([this] { return status_ && status_->link_state == bridge_status_t::LINK_UP; })) return false;
  if (!lease.held() && !take_lease()) return false;
  bridge_cmd_t cmd = {};
  cmd.action = bridge_cmd_t::UPLOAD;
  cmd.profile_id = profile_id;
  cmd.n_segments = 1;
  segment_t& s = cmd.segments[0];
  s.kind = segment_t::VOLTAGE;
  s.duration_samples = 900'000'000;
  s.amplitude_start_V = s.amplitude_end_V = 50.0;
  s.frequency_start_Hz = s.frequency_end_Hz = 30.0;
  return send(cmd) == CommandResult::kDone && act(bridge_cmd_t::START, profile_id) == CommandResult::kDone;
}

void Commander::estop() {
  imrig_msg::estop_cmd_t cmd = {};
  cmd.estop_cmd_v1 = 1;
  cmd.issued_host_utime = wall_us();
  cmd.ttl_ms = 1000;
  publish(*bus, channel::kEstopCmd, cmd);
}

}  // namespace imrig
