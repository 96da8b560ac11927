// imrig-bridge: composes BridgeCore, the DSP link's transport and the bus.

#include <poll.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <array>
#include <cstdio>

#include "rig/base/clock.h"
#include "rig/base/command_line.h"
#include "rig/base/error.h"
#include "rig/base/rig_config.h"
#include "rig/base/stop_signal.h"
#include "rig/bridge/bridge_core.h"
#include "rig/bus/bus.h"
#include "rig/bus/channels.h"
#include "rig/link/transport.h"
#include "rig/safety/trip.h"

namespace imrig {
namespace {

constexpr int kTimer_ms = 5;
constexpr int kReadsPerRound = 64;  // then the bus gets its turn

Moment now() { return {monotonic_us(), wall_us()}; }

const char* channel_of(const imrig_msg::samples_t&) { return channel::kSamples; }
const char* channel_of(const imrig_msg::bridge_status_t&) { return channel::kBridgeStatus; }
const char* channel_of(const imrig_msg::lease_t&) { return channel::kBridgeLease; }
const char* channel_of(const imrig_msg::heartbeat_t&) { return channel::kHeartbeat; }

template <class Message>
void connect(Bus& bus, const char* name, BridgeCore& core,
             void (BridgeCore::*handler)(const Message&, Moment)) {
  subscribe<Message>(bus, name,
                     [&core, handler](const Message& message) { (core.*handler)(message, now()); });
}

void subscribe_all(Bus& bus, BridgeCore& core) {
  connect(bus, channel::kLeaseCmd, core, &BridgeCore::on_lease_cmd);
  connect(bus, channel::kBridgeCmd, core, &BridgeCore::on_bridge_cmd);
  connect(bus, channel::kEstopCmd, core, &BridgeCore::on_estop);
  connect(bus, channel::kHeartbeat, core, &BridgeCore::on_heartbeat);
  connect(bus, channel::kAck, core, &BridgeCore::on_ack);
}

// The operator's log, on stderr: links and trips.
void tell(const imrig_msg::bridge_status_t& status) {
  static std::int32_t link = imrig_msg::bridge_status_t::LINK_ABSENT, trip = 0;
  if (status.link_state != link) {
    const bool up = status.link_state == imrig_msg::bridge_status_t::LINK_UP;
    if (up) spdlog::info("DSP link up, boot {}", status.boot_id);
    if (!up) spdlog::warn("DSP link silent");
  }
  if (status.trip != trip && status.trip != 0)
    spdlog::error("tripped: {}", trip_name(static_cast<Trip>(status.trip)));
  if (status.trip != trip && status.trip == 0) spdlog::info("reset");
  link = status.link_state;
  trip = status.trip;
}

void flush(BridgeCore& core, Transport& wire, Bus& bus) {
  static std::vector<std::uint8_t> packet;
  while (core.next_packet(packet)) wire.write(packet);
  core.take_messages([&](const BridgeMessage& message) {
    if (const auto* status = std::get_if<imrig_msg::bridge_status_t>(&message)) tell(*status);
    std::visit([&](const auto& m) { publish(bus, channel_of(m), m); }, message);
  });
}

void read_wire(BridgeCore& core, Transport& wire) {
  static std::array<std::uint8_t, 65536> buffer;
  for (int k = 0; k < kReadsPerRound; ++k) {
    const std::size_t n = wire.read(buffer);
    if (n == 0) return;
    core.on_link_bytes({buffer.data(), n}, now());
  }
}

void run(BridgeCore& core, Transport& wire, Bus& bus) {
  while (!core.finished(now())) {
    std::array<pollfd, 2> waits = {{{wire.fd(), POLLIN, 0}, {bus.fd(), POLLIN, 0}}};
    ::poll(waits.data(), waits.size(), kTimer_ms);
    if (stop_asked()) core.shut_down(now());
    bus.wait(0);
    core.poll(now());  // an emergency stop leaves before the next samples are looked at
    flush(core, wire, bus);
    read_wire(core, wire);
    core.poll(now());
    flush(core, wire, bus);
  }
}

int body(int argc, char** argv) {
  CLI::App app{"imrig-bridge: the process between the DSP link and the bus."};
  std::string path = "rig.toml";
  app.add_option("--config", path, "the rig's configuration")->capture_default_str();
  if (const auto done = parse_command_line(app, "imrig-bridge", argc, argv)) return *done;
  spdlog::set_default_logger(spdlog::stderr_color_mt("imrig-bridge"));
  const RigConfig config = load_rig_config(path);
  const auto wire = open_transport(config.bridge.link);
  const auto bus = open_lcm_bus(config.bus);
  BridgeCore core(config, ::getpid(), random_id);
  subscribe_all(*bus, core);
  catch_stop_signals();
  std::puts("ready");
  std::fflush(stdout);
  run(core, *wire, *bus);
  return 0;
}

}  // namespace
}  // namespace imrig

int main(int argc, char** argv) { return imrig::run_main("imrig-bridge", imrig::body, argc, argv); }
