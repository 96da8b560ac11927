// imrig status: who is alive, what the links, the motor and the load do, who holds the leases.

#include <fmt/format.h>

#include <memory>

#include "rig/base/clock.h"
#include "rig/bus/replay.h"
#include "rig/cli/json_number.h"
#include "rig/cli/rig_watch.h"
#include "rig/cli/text_table.h"
#include "rig/cli/verbs.h"
#include "rig/safety/trip.h"

namespace imrig {

namespace {

constexpr int kListen_ms = 1000;  // five heartbeats

struct Options {
  std::string config;
  bool json = false;
};

std::string trip_text(std::int32_t trip) { return std::string(trip_name(static_cast<Trip>(trip))); }

Json json_of_lease(const std::optional<imrig_msg::lease_t>& lease) {
  if (!lease || lease->epoch == 0) return nullptr;
  return {{"holder", lease->holder}, {"expires_in_ms", lease->expires_in_ms}};
}

Json json_of_bridge(const RigWatch& rig) {
  if (!rig.bridge) return nullptr;
  const auto& s = *rig.bridge;
  return {{"link", link_word(s.link_state)},
          {"run_state", drive_word(s.run_state)},
          {"trip", s.trip},
          {"trip_name", trip_text(s.trip)},
          {"profile_id", s.profile_id},
          {"speed_rpm", json_number(s.speed_rpm)},
          {"current_peak_A", json_number(s.current_peak_A)},
          {"stator_C", json_number(s.stator_C)},
          {"samples", s.next_index},
          {"lost_blocks", s.lost_blocks},
          {"bad_frames", s.bad_frames},
          {"lease", json_of_lease(rig.bridge_lease)}};
}

Json json_of_dyno(const RigWatch& rig) {
  if (!rig.dyno) return nullptr;
  const auto& s = *rig.dyno;
  return {{"link", link_word(s.link_state)},
          {"run_state", load_word(s.run_state)},
          {"trip", s.trip},
          {"trip_name", trip_text(s.trip)},
          {"output_on", s.output_on != 0},
          {"readback_V", json_number(s.readback_V)},
          {"readback_A", json_number(s.readback_A)},
          {"lease", json_of_lease(rig.dyno_lease)}};
}

Json json_of(const RigWatch& rig) {
  Json processes = Json::array();
  for (const auto& [who, h] : rig.processes) {
    processes.push_back({{"process", process_name(h.process)},
                         {"pid", h.pid},
                         {"state", health_word(h.state)},
                         {"code", h.state_code},
                         {"rig_time_s", static_cast<double>(h.utime) / 1e6}});
  }
  Json campaign = nullptr;
  if (rig.campaign) {
    const auto& c = *rig.campaign;
    campaign = {{"plan", c.plan},
                {"point", c.point_id},
                {"points_done", c.points_done},
                {"points_total", c.points_total}};
  }
  return {{"alive", rig.anybody() || !rig.processes.empty()},
          {"processes", processes},
          {"bridge", json_of_bridge(rig)},
          {"dyno", json_of_dyno(rig)},
          {"campaign", campaign}};
}

std::string lease_text(const std::optional<imrig_msg::lease_t>& lease) {
  if (!lease || lease->epoch == 0) return "free";
  return fmt::format("held by {:x}, {} ms left", lease->holder, lease->expires_in_ms);
}

void print_processes(const RigWatch& rig) {
  TextTable table({"<process", "pid", "<state", "rig time, s"});
  for (const auto& [who, h] : rig.processes) {
    table.row({process_name(h.process), std::to_string(h.pid), health_word(h.state),
               fmt::format("{:.3f}", static_cast<double>(h.utime) / 1e6)});
  }
  fmt::print("{}", table.text());
}

void print_motor(const RigWatch& rig) {
  if (!rig.bridge) return;
  const auto& s = *rig.bridge;
  fmt::print("\nmotor    {}, DSP link {}, trip: {}\n", drive_word(s.run_state), link_word(s.link_state),
             trip_text(s.trip));
  fmt::print("         {} rpm, {} A peak, winding {} deg C\n", shown(s.speed_rpm), shown(s.current_peak_A),
             shown(s.stator_C));
  fmt::print("         blocks lost {}, bad frames {}\n", s.lost_blocks, s.bad_frames);
  fmt::print("         lease {}\n", lease_text(rig.bridge_lease));
}

void print_load(const RigWatch& rig) {
  if (!rig.dyno) return;
  const auto& s = *rig.dyno;
  fmt::print("\nload     {}, Modbus {}, trip: {}\n", load_word(s.run_state), link_word(s.link_state),
             trip_text(s.trip));
  fmt::print("         excitation {} V, {} A, output {}\n", shown(s.readback_V), shown(s.readback_A),
             s.output_on != 0 ? "on" : "off");
  fmt::print("         lease {}\n", lease_text(rig.dyno_lease));
}

void print_campaign(const RigWatch& rig) {
  if (!rig.campaign) return;
  const auto& c = *rig.campaign;
  fmt::print("\ncampaign {}, at {}, {} of {} points done\n", printable(c.plan), printable(c.point_id),
             c.points_done, c.points_total);
}

int run(const Options& options) {
  const BusConfig config = bus_of_rig(options.config);
  const auto bus = open_lcm_bus(config);
  RigWatch rig(*bus);
  rig.listen(kListen_ms, [] { return false; });
  const bool alive = rig.anybody() || !rig.processes.empty();
  if (options.json) {
    fmt::print("{}\n", json_text(json_of(rig)));
  } else if (alive) {
    print_processes(rig);
    print_motor(rig);
    print_load(rig);
    print_campaign(rig);
  } else {
    fmt::print("no rig is alive on {}\n", config.url);
  }
  return alive ? 0 : 1;
}

}  // namespace

void add_status(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<Options>();
  CLI::App* verb =
      app.add_subcommand("status", "Listen for a second and tell what the rig does; 1 when no rig is alive");
  verb->add_option("--config", options->config, "rig.toml, for the bus");
  verb->add_flag("--json", options->json, "as JSON");
  verb->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace imrig
