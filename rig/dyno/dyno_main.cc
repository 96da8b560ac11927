// imrig-dyno: composes DynoCore, the Modbus client and the bus. Heartbeats do not wait for Modbus, which has
// its own thread.

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cstdio>

#include "rig/base/clock.h"
#include "rig/base/command_line.h"
#include "rig/base/error.h"
#include "rig/base/rig_config.h"
#include "rig/base/stop_signal.h"
#include "rig/bus/bus.h"
#include "rig/bus/channels.h"
#include "rig/dyno/dyno_core.h"
#include "rig/dyno/modbus_client.h"

namespace imrig {
namespace {

using imrig_msg::heartbeat_t;

constexpr int kWait_ms = 5;
constexpr std::int64_t kStatus_us = 50'000;
constexpr std::int64_t kLease_us = 100'000;
constexpr std::int64_t kHeartbeat_us = 200'000;
constexpr std::int64_t kFarewell_us = 2'000'000;  // for switching the supply off at the end

Moment now() { return {monotonic_us(), wall_us()}; }

// What a new status says apart from its time; measured values alone are no change.
bool same_news(imrig_msg::dyno_status_t a, imrig_msg::dyno_status_t b) {
  return a.link_state == b.link_state && a.run_state == b.run_state && a.trip == b.trip && a.mode == b.mode &&
         a.target == b.target && a.output_on == b.output_on && a.at_target == b.at_target &&
         a.last_cmd_epoch == b.last_cmd_epoch && a.last_cmd_seq == b.last_cmd_seq &&
         a.last_cmd_result == b.last_cmd_result;
}

class DynoProcess {
 public:
  DynoProcess(const DynoCoreConfig& config, ModbusClient& client, Bus& bus)
      : core_(config, random_id), client_(client), bus_(bus), instance_(random_id()) {
    subscribe<imrig_msg::dyno_cmd_t>(bus, channel::kDynoCmd,
                                     [this](const auto& m) { core_.on_command(m, now()); });
    subscribe<imrig_msg::estop_cmd_t>(bus, channel::kEstopCmd,
                                      [this](const auto& m) { core_.on_estop(m, now()); });
    subscribe<heartbeat_t>(bus, channel::kHeartbeat, [this](const auto& m) { core_.on_heartbeat(m, now()); });
    subscribe<imrig_msg::samples_t>(bus, channel::kSamples, [this](const auto& m) { core_.on_samples(m); });
    subscribe<imrig_msg::lease_cmd_t>(bus, channel::kLeaseCmd, [this](const auto& m) {
      if (core_.on_lease(m, now())) lease_due_us_ = 0;
    });
  }

  void turn(int wait_ms) {
    bus_.wait(wait_ms);
    const Moment t = now();
    core_.on_supply(client_.report(), t);
    client_.order(core_.step(t));
    publish_status(t);
    publish_lease(t);
    publish_heartbeat(t, core_.heartbeat_state());
    tell_trouble();
  }

  // Excitation off, as far as the supply can be reached, and goodbye.
  void stop() {
    const std::int64_t deadline_us = monotonic_us() + kFarewell_us;
    core_.stop();
    while (!core_.supply_is_off() && client_.report().link == SupplyLink::kUp &&
           monotonic_us() < deadline_us) {
      turn(kWait_ms);
    }
    heartbeat_due_us_ = 0;
    publish_heartbeat(now(), heartbeat_t::STOPPING);
  }

 private:
  void publish_status(Moment t) {
    imrig_msg::dyno_status_t status = core_.status(t);
    if (t.steady_us < status_due_us_ && same_news(status, status_)) return;
    status_due_us_ = t.steady_us + kStatus_us;
    status.seq = ++status_seq_;
    publish(bus_, channel::kDynoStatus, status);
    status_ = status;
  }

  void publish_lease(Moment t) {
    if (t.steady_us < lease_due_us_) return;
    lease_due_us_ = t.steady_us + kLease_us;
    imrig_msg::lease_t lease = core_.lease(t);
    lease.seq = ++lease_seq_;
    publish(bus_, channel::kDynoLease, lease);
  }

  void publish_heartbeat(Moment t, std::int32_t state) {
    if (t.steady_us < heartbeat_due_us_ && state == heartbeat_state_) return;
    heartbeat_due_us_ = t.steady_us + kHeartbeat_us;
    heartbeat_state_ = state;
    heartbeat_t beat = {};
    beat.utime = core_.rig_utime();
    beat.seq = ++heartbeat_seq_;
    beat.heartbeat_v1 = 1;
    beat.host_utime = t.wall_us;
    beat.instance = instance_;
    beat.process = heartbeat_t::DYNO;
    beat.pid = ::getpid();
    beat.state = state;
    beat.state_code = static_cast<std::int32_t>(core_.trip());
    publish(bus_, channel::kHeartbeat, beat);
  }

  void tell_trouble() {
    if (core_.trip() != told_trip_) {
      told_trip_ = core_.trip();
      if (told_trip_ != Trip::kNone) spdlog::error("tripped: {}", trip_name(told_trip_));
    }
    const std::string trouble = client_.trouble();
    if (trouble == told_trouble_) return;
    told_trouble_ = trouble;
    if (trouble.empty()) {
      spdlog::info("excitation supply answers");
    } else {
      spdlog::warn("excitation supply: {}", trouble);
    }
  }

  DynoCore core_;
  ModbusClient& client_;
  Bus& bus_;
  std::int64_t instance_;
  imrig_msg::dyno_status_t status_ = {};
  std::int32_t heartbeat_state_ = heartbeat_t::STARTING;
  std::int64_t status_due_us_ = 0, lease_due_us_ = 0, heartbeat_due_us_ = 0;
  std::int64_t status_seq_ = 0, lease_seq_ = 0, heartbeat_seq_ = 0;
  Trip told_trip_ = Trip::kNone;
  std::string told_trouble_ = "not reached yet";
};

DynoCoreConfig core_config(const RigConfig& rig, const RegisterMap& map) {
  DynoCoreConfig config{rig.dyno, rig.limits, rig.generator};
  config.can_set_V = map.find(Role::kSetV) != nullptr;
  config.can_set_A = map.find(Role::kSetA) != nullptr;
  if (config.can_set_A) config.resolution_A = map.find(Role::kSetA)->resolution(rig.dyno.max_A);
  return config;
}

int body(int argc, char** argv) {
  CLI::App app{"imrig-dyno: the process between the excitation supply of the load generator and the bus."};
  std::string path = "rig.toml";
  app.add_option("--config", path, "the rig's configuration")->capture_default_str();
  if (const auto done = parse_command_line(app, "imrig-dyno", argc, argv)) return *done;
  spdlog::set_default_logger(spdlog::stderr_color_mt("imrig-dyno"));
  const RigConfig config = load_rig_config(path);
  const RegisterMap map = load_register_map(config.dyno.register_map);
  const auto bus = open_lcm_bus(config.bus);
  catch_stop_signals();
  ModbusClient client({config.dyno.link, config.dyno.response_ms, config.dyno.poll_ms}, map);
  DynoProcess process(core_config(config, map), client, *bus);
  std::puts("ready");
  std::fflush(stdout);
  while (!stop_asked()) process.turn(kWait_ms);
  process.stop();
  return 0;
}

}  // namespace
}  // namespace imrig

int main(int argc, char** argv) { return imrig::run_main("imrig-dyno", imrig::body, argc, argv); }
