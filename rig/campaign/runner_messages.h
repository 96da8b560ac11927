#pragma once
// What a running campaign says of itself on the bus. utime and seq are the outbox's to fill.

#include <cmath>
#include <cstdint>
#include <imrig_msg/ack_t.hpp>
#include <imrig_msg/dataset_t.hpp>
#include <imrig_msg/heartbeat_t.hpp>
#include <string>

#include "rig/base/rig_config.h"
#include "rig/campaign/sample_watch.h"
#include "rig/safety/moment.h"

namespace imrig {

// Noise is left to the readers of the log, who measure it while the gates are off.
inline imrig_msg::dataset_t dataset_message(const std::string& plan, const RigConfig& rig) {
  imrig_msg::dataset_t d = {};
  d.dataset_v1 = 1;
  d.name = plan;
  d.pole_pairs = rig.motor.pole_pairs;
  d.noise_current_A = d.noise_voltage_V = d.noise_speed_rad_s = d.noise_torque_Nm = d.noise_power_W =
      std::nan("");
  d.accuracy_current_gain = rig.accuracy.current_gain;
  d.accuracy_voltage_gain = rig.accuracy.voltage_gain;
  return d;
}

inline imrig_msg::heartbeat_t campaign_heartbeat(std::int64_t instance, std::int32_t pid, bool ending,
                                                 std::int32_t trip, Moment now) {
  imrig_msg::heartbeat_t h = {};
  h.heartbeat_v1 = 1;
  h.host_utime = now.wall_us;
  h.instance = instance;
  h.process = imrig_msg::heartbeat_t::CAMPAIGN;
  h.pid = pid;
  h.state = imrig_msg::heartbeat_t::OK;
  if (ending) h.state = imrig_msg::heartbeat_t::STOPPING;
  h.state_code = trip;
  return h;
}

inline imrig_msg::ack_t campaign_ack(const SampleWatch& watch, std::int64_t read_index, std::int32_t pid) {
  imrig_msg::ack_t ack = {};
  ack.ack_v1 = 1;
  ack.boot_id = watch.boot_id();
  ack.read_index = read_index;
  ack.lost_blocks = watch.lost_blocks();
  ack.process = imrig_msg::heartbeat_t::CAMPAIGN;
  ack.pid = pid;
  return ack;
}

}  // namespace imrig
