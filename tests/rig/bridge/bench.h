#pragma once
// A bridge core and the real device core on a wire in memory, in virtual time: one step is one millisecond of
// host time. The wire can be cut, packets can be lost; the device can be rebooted. A commander with a lease
// client of its own stands at the bus.

#include <cstdint>
#include <functional>
#include <imrig_msg/bridge_cmd_t.hpp>
#include <imrig_msg/lease_t.hpp>
#include <memory>
#include <vector>

#include "rig/bridge/bridge_core.h"
#include "rig/link/device/imrig_device.h"
#include "rig/safety/lease_client.h"

namespace imrig {

class Bench {
 public:
  using cmd_t = imrig_msg::bridge_cmd_t;

  explicit Bench(RigConfig rig = default_rig(), bool device_waits = false);

  static RigConfig default_rig();

  // Host time passes, device time with it (pace 1) unless the device waits for credit, when it runs ahead as
  // far as it may.
  void run_ms(int ms);
  bool run_until(const std::function<bool()>& reached, int at_most_ms);

  // Commander's side.
  bool take_lease(int at_most_ms = 1000);
  CommandResult send(cmd_t& cmd);  // signs, delivers, waits for the answer that is not pending
  CommandResult upload_voltage(std::int32_t id, double peak_V = 50.0, double f_Hz = 30.0,
                               std::int64_t samples = 100'000'000,
                               std::int32_t at_end = cmd_t::AT_END_GATES_OFF);
  CommandResult act(std::int32_t action, std::int32_t profile_id = 0);
  void start_motor(std::int32_t id = 1);  // lease, upload, start; gates are on afterwards
  void estop();
  void dyno_beats(std::int32_t state);  // one heartbeat of a dyno
  void ack(std::int32_t process, std::int64_t read_index);

  void reboot_device();
  void restart_bridge();
  bool gates_on() const { return device.drive.command.legs != 0 && imrig_device_must_be_off(&device) == 0; }

  RigConfig rig;
  Moment now = {10'000'000, 1'800'000'000'000'000};
  imrig_device device;
  imrig_counts counts;  // what the device measures, until changed
  std::unique_ptr<BridgeCore> core;
  LeaseClient client;
  bool client_alive = true;
  bool wire_up = true;
  int device_speed = 1;                                      // times real time
  std::function<bool(std::span<const std::uint8_t>)> loses;  // true: this packet from the device is lost

  std::vector<imrig_msg::samples_t> samples;
  std::vector<imrig_msg::bridge_status_t> statuses;
  std::vector<imrig_msg::heartbeat_t> heartbeats;
  std::vector<imrig_msg::lease_t> leases;
  const imrig_msg::bridge_status_t& status() const { return statuses.back(); }

 private:
  void step();
  void take();
  void device_to_core();
  void core_to_device();
  void device_time();

  bool device_waits_;
  std::int64_t boots_ = 0;
  double owed_samples_ = 0.0;
  std::int64_t ids_ = 100;
  std::int64_t dyno_seq_ = 0;
  std::vector<std::uint8_t> frame_ = std::vector<std::uint8_t>(IMRIG_FRAME_MAX);
};

}  // namespace imrig
