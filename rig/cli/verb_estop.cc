// imrig estop: stops the rig now. Sends ESTOP_CMD again and again until every actuator that speaks reports a
// trip. No substitute for the emergency stop button: this goes through software and a network.

#include <fmt/format.h>

#include <imrig_msg/estop_cmd_t.hpp>
#include <memory>
#include <vector>

#include "rig/base/clock.h"
#include "rig/bus/channels.h"
#include "rig/cli/rig_watch.h"
#include "rig/cli/verbs.h"
#include "rig/safety/trip.h"

namespace imrig {

namespace {

constexpr int kAnswer_ms = 2000;
constexpr std::int64_t kEverybody_us =
    300'000;  // an actuator speaks every 50 ms: who is silent for so long is not there
constexpr std::int32_t kTtl_ms = 1000;

void send_stop(Bus& bus, std::int64_t seq) {
  imrig_msg::estop_cmd_t cmd = {};
  cmd.seq = seq;
  cmd.estop_cmd_v1 = 1;
  cmd.issued_host_utime = wall_us();
  cmd.ttl_ms = kTtl_ms;
  publish(bus, channel::kEstopCmd, cmd);
}

// Trips that are not there yet, as sentences; empty when everybody who speaks has tripped.
std::vector<std::string> not_stopped(const RigWatch& rig) {
  std::vector<std::string> names;
  if (rig.bridge && rig.bridge->trip == 0) names.push_back("imrig-bridge");
  if (rig.dyno && rig.dyno->trip == 0) names.push_back("imrig-dyno");
  return names;
}

void tell(const char* name, std::int32_t trip) {
  fmt::print("{}: tripped ({})\n", name, trip_name(static_cast<Trip>(trip)));
}

int run(const std::string& config_path) {
  const BusConfig config = bus_of_rig(config_path);
  const auto bus = open_lcm_bus(config);
  std::int64_t seq = 0;
  // Listens before it sends: a campaign that hears the stop takes its own rig down, and its last words count.
  RigWatch rig(*bus);
  send_stop(*bus, ++seq);
  const std::int64_t started_us = monotonic_us();
  const auto stopped = [&] {
    return rig.anybody() && not_stopped(rig).empty() && monotonic_us() - started_us >= kEverybody_us;
  };
  const bool done = rig.listen(kAnswer_ms, stopped, [&] { send_stop(*bus, ++seq); });
  if (rig.bridge && rig.bridge->trip != 0) tell("imrig-bridge", rig.bridge->trip);
  if (rig.dyno && rig.dyno->trip != 0) tell("imrig-dyno", rig.dyno->trip);
  if (done) return 0;
  if (!rig.anybody()) fmt::print(stderr, "imrig: nobody answered the emergency stop on {}\n", config.url);
  for (const auto& name : not_stopped(rig))
    fmt::print(stderr, "imrig: {} has not tripped; use the emergency stop button\n", name);
  return 1;
}

}  // namespace

void add_estop(CLI::App& app, int& exit_code) {
  const auto config = std::make_shared<std::string>();
  CLI::App* verb =
      app.add_subcommand("estop", "Stop the rig now; needs no lease. 1 when nobody answers within 2 s");
  verb->add_option("--config", *config, "rig.toml, for the bus");
  verb->callback([config, &exit_code] { exit_code = run(*config); });
}

}  // namespace imrig
