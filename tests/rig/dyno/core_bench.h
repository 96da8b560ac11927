#pragma once
// A DynoCore in virtual time, 5 ms of host time a step, with a commander that holds a real lease, a bridge's
// heartbeat, a turning shaft and a supply that takes each order at the next step but one. Each of them can be
// made to fail.

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "rig/dyno/dyno_core.h"
#include "rig/safety/lease_client.h"

namespace imrig {

class CoreBench {
 public:
  using cmd_t = imrig_msg::dyno_cmd_t;
  static constexpr std::int64_t kStep_us = 5'000;

  explicit CoreBench(DynoCoreConfig config = {})
      : core(config, [this] { return ++last_id_; }), lease(imrig_msg::heartbeat_t::DYNO, 4711, 2'000'000) {
    lease.acquire();
    run_s(0.2);
  }

  void run_s(double seconds) {
    for (int k = 0; k < static_cast<int>(std::lround(1e6 * seconds / kStep_us)); ++k) step();
  }

  CommandResult send(cmd_t cmd) {
    lease.sign(cmd, now);
    core.on_command(cmd, now);
    return result();
  }
  CommandResult set(std::int32_t mode, double value,
                    double ramp_per_s = std::numeric_limits<double>::quiet_NaN()) {
    cmd_t cmd = {};
    cmd.action = cmd_t::SET;
    cmd.mode = mode;
    cmd.value = value;
    cmd.ramp_per_s = ramp_per_s;
    return send(cmd);
  }
  CommandResult act(std::int32_t action) {
    cmd_t cmd = {};
    cmd.action = action;
    return send(cmd);
  }
  CommandResult result() const { return static_cast<CommandResult>(core.status(now).last_cmd_result); }

  void estop(std::int64_t age_us = 0) {
    imrig_msg::estop_cmd_t stop = {};
    stop.issued_host_utime = now.wall_us - age_us;
    stop.ttl_ms = 1000;
    core.on_estop(stop, now);
  }

  bool is_off() const { return order == SupplyOrder{0.0, 0.0, false, order.number}; }

  Moment now = {1'000'000'000, 1'800'000'000'000'000};
  SupplyOrder order;
  SupplyReport supply;
  bool supply_answers = true;
  bool commander_alive = true;
  bool bridge_beats = false;
  std::int32_t bridge_state = imrig_msg::heartbeat_t::OK;
  bool samples_flow = false;
  double rpm = 1500.0;
  int rig_speed = 1;  // times real time
  std::int64_t last_id_ = 1000;
  DynoCore core;
  LeaseClient lease;

 private:
  void step() {
    now.steady_us += kStep_us;
    now.wall_us += kStep_us;
    if (commander_alive) {
      lease.on_lease(core.lease(now), now);
      if (lease.lost()) lease.acquire();
      if (const auto request = lease.step(now)) core.on_lease(*request, now);
    }
    if (bridge_beats) beat();
    if (samples_flow) {
      for (int k = 0; k < rig_speed; ++k) shaft_turns();
    }
    if (supply_answers) take_order();
    core.on_supply(supply, now);
    order = core.step(now);
  }

  void beat() {
    imrig_msg::heartbeat_t beat = {};
    beat.process = imrig_msg::heartbeat_t::BRIDGE;
    beat.instance = 99;
    beat.seq = ++beats_;
    beat.host_utime = now.wall_us;
    beat.state = bridge_state;
    core.on_heartbeat(beat, now);
  }

  // 50 samples of 100 us.
  void shaft_turns() {
    imrig_msg::samples_t m = {};
    m.boot_id = 5;
    m.first_index = samples_;
    m.sample_time_ns = 100'000;
    m.encoder_counts_per_rev = 10000;
    m.n = 50;
    for (int k = 0; k < m.n; ++k) {
      angle_counts_ += rpm / 60.0 * 1e-4 * m.encoder_counts_per_rev;
      m.encoder.push_back(static_cast<std::int32_t>(std::floor(angle_counts_)));
    }
    samples_ += m.n;
    core.on_samples(m);
  }

  void take_order() {
    supply.link = SupplyLink::kUp;
    supply.heard_steady_us = now.steady_us;
    supply.as_written = !supply.mismatch;
    supply.order_number = order.number;
    supply.held_V = order.set_V;
    supply.held_A = order.set_A;
    supply.output_on = order.output_on && supply.protection == 0;
    supply.out_V = supply.output_on ? std::min(order.set_V, 20.0 * order.set_A) : 0.0;  // a field of 20 ohm
    supply.out_A = supply.out_V / 20.0;
  }

  std::int64_t beats_ = 0, samples_ = 0;
  double angle_counts_ = 0.0;
};

}  // namespace imrig
