#include "tests/rig/bridge/bench.h"

#include <gtest/gtest.h>

#include <cmath>

namespace imrig {

using imrig_msg::bridge_cmd_t;
using imrig_msg::heartbeat_t;
using imrig_msg::segment_t;

RigConfig Bench::default_rig() {
  RigConfig rig;
  rig.limits.current_A = 30.0;
  rig.limits.voltage_V = 200.0;
  rig.bridge.credit_blocks = 8;
  return rig;
}

Bench::Bench(RigConfig config, bool device_waits)
    : rig(std::move(config)),
      core(std::make_unique<BridgeCore>(rig, 4711, [this] { return ++ids_; })),
      client(heartbeat_t::BRIDGE, 77, std::int64_t{rig.limits.lease_ms} * 1000),
      device_waits_(device_waits) {
  counts = {};
  counts.stator_C = 25.0f;
  reboot_device();
}

void Bench::reboot_device() {
  imrig_device_config config = {};
  config.boot_id = 1000 + ++boots_;
  config.sample_time_ns = 60'000;
  config.pwm_samples = 4;
  config.current_A_per_count = 0.025f;
  config.voltage_V_per_count = 0.2f;
  config.full_scale_counts = 2047;
  config.encoder_counts_per_rev = 4096;
  config.waits_for_credit = device_waits_ ? 1 : 0;
  imrig_device_init(&device, &config);
}

void Bench::restart_bridge() {
  core = std::make_unique<BridgeCore>(rig, 4712, [this] { return ++ids_; });
}

void Bench::device_to_core() {
  while (const std::size_t n = imrig_device_take(&device, frame_.data(), frame_.size())) {
    const std::span<const std::uint8_t> packet(frame_.data(), n);
    if (!wire_up || (loses && loses(packet))) continue;
    core->on_link_bytes(packet, now);
  }
}

void Bench::core_to_device() {
  std::vector<std::uint8_t> packet;
  while (core->next_packet(packet)) {
    if (wire_up) imrig_device_feed(&device, packet.data(), packet.size(), now.steady_us / 1000);
  }
  imrig_device_tick(&device, now.steady_us / 1000);
}

void Bench::device_time() {
  owed_samples_ = device_waits_ ? 3000.0 : owed_samples_ + 1000.0 / 60.0 * device_speed;
  for (; owed_samples_ >= 1.0 && imrig_device_may_sample(&device) != 0; owed_samples_ -= 1.0) {
    imrig_device_sample(&device, &counts);
    device_to_core();
  }
  if (imrig_device_may_sample(&device) == 0) owed_samples_ = 0.0;
}

void Bench::take() {
  core->take_messages([this](const BridgeMessage& message) {
    if (const auto* m = std::get_if<imrig_msg::samples_t>(&message)) samples.push_back(*m);
    if (const auto* m = std::get_if<imrig_msg::bridge_status_t>(&message)) statuses.push_back(*m);
    if (const auto* m = std::get_if<heartbeat_t>(&message)) heartbeats.push_back(*m);
    if (const auto* m = std::get_if<imrig_msg::lease_t>(&message)) {
      leases.push_back(*m);
      if (client_alive) client.on_lease(*m, now);
    }
  });
}

void Bench::step() {
  now = {now.steady_us + 1000, now.wall_us + 1000};
  device_time();
  device_to_core();
  if (client_alive) {
    if (const auto cmd = client.step(now)) core->on_lease_cmd(*cmd, now);
  }
  core->poll(now);
  core_to_device();
  take();
}

void Bench::run_ms(int ms) {
  for (int k = 0; k < ms; ++k) step();
}

bool Bench::run_until(const std::function<bool()>& reached, int at_most_ms) {
  for (int k = 0; k < at_most_ms && !reached(); ++k) step();
  return reached();
}

bool Bench::take_lease(int at_most_ms) {
  client.acquire();
  return run_until([this] { return client.held(); }, at_most_ms);
}

CommandResult Bench::send(bridge_cmd_t& cmd) {
  cmd.bridge_cmd_v1 = 1;
  client.sign(cmd, now);
  core->on_bridge_cmd(cmd, now);
  take();
  const auto answered = [&] {
    return !statuses.empty() && status().last_cmd_epoch == cmd.lease_epoch &&
           status().last_cmd_seq == cmd.seq &&
           status().last_cmd_result != static_cast<std::int32_t>(CommandResult::kPending);
  };
  if (!run_until(answered, 5000)) return CommandResult::kPending;
  return static_cast<CommandResult>(status().last_cmd_result);
}

CommandResult Bench::upload_voltage(std::int32_t id, double peak_V, double f_Hz, std::int64_t duration,
                                    std::int32_t at_end) {
  bridge_cmd_t cmd = {};
  cmd.action = bridge_cmd_t::UPLOAD;
  cmd.profile_id = id;
  cmd.at_end = at_end;
  cmd.n_segments = 1;
  segment_t& s = cmd.segments[0];
  s.kind = segment_t::VOLTAGE;
  s.duration_samples = duration;
  s.amplitude_start_V = s.amplitude_end_V = peak_V;
  s.frequency_start_Hz = s.frequency_end_Hz = f_Hz;
  return send(cmd);
}

CommandResult Bench::act(std::int32_t action, std::int32_t profile_id) {
  bridge_cmd_t cmd = {};
  cmd.action = action;
  cmd.profile_id = profile_id;
  return send(cmd);
}

void Bench::start_motor(std::int32_t id) {
  run_ms(50);
  if (!client.held()) {
    ASSERT_TRUE(take_lease());
  }
  ASSERT_EQ(upload_voltage(id), CommandResult::kDone);
  ASSERT_EQ(act(bridge_cmd_t::START, id), CommandResult::kDone);
  run_ms(50);
  ASSERT_TRUE(gates_on());
  ASSERT_EQ(core->state(), StopState::kRunning);
}

void Bench::estop() {
  imrig_msg::estop_cmd_t cmd = {};
  cmd.estop_cmd_v1 = 1;
  cmd.issued_host_utime = now.wall_us;
  core->on_estop(cmd, now);
}

void Bench::dyno_beats(std::int32_t state) {
  heartbeat_t h = {};
  h.heartbeat_v1 = 1;
  h.seq = ++dyno_seq_;
  h.host_utime = now.wall_us;
  h.instance = 5;
  h.process = heartbeat_t::DYNO;
  h.state = state;
  core->on_heartbeat(h, now);
}

void Bench::ack(std::int32_t process, std::int64_t read_index) {
  imrig_msg::ack_t a = {};
  a.ack_v1 = 1;
  a.boot_id = device.config.boot_id;
  a.read_index = read_index;
  a.process = process;
  core->on_ack(a, now);
}

}  // namespace imrig
