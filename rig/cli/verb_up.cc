// imrig up: starts the rig's processes, watches them, stops them safely.

#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>
#include <imrig_msg/bridge_status_t.hpp>
#include <imrig_msg/dyno_status_t.hpp>
#include <imrig_msg/heartbeat_t.hpp>
#include <map>
#include <memory>

#include "rig/base/clock.h"
#include "rig/base/error.h"
#include "rig/base/stop_signal.h"
#include "rig/bus/bus.h"
#include "rig/bus/channels.h"
#include "rig/cli/supervisor/rig_processes.h"
#include "rig/cli/verbs.h"
#include "rig/safety/trip.h"

namespace imrig {

namespace {

using namespace imrig_msg;

constexpr std::int64_t kFirstWords_us =
    3'000'000;  // until when every process must have been heard on the bus
constexpr std::int64_t kSilence_us = 3'000'000;

struct Options {
  std::string rig_path;
  std::string plant_path;
  std::string pace = "realtime";
  std::string folder;
  std::optional<long long> seed;
};

std::string make_run_folder(const std::string& wanted) {
  if (!wanted.empty()) {
    std::error_code failed;
    std::filesystem::create_directories(wanted, failed);
    if (failed) throw Error(wanted, "cannot be made: " + failed.message());
    return std::filesystem::absolute(wanted).string();
  }
  std::string folder = (std::filesystem::temp_directory_path() / "imrig-up-XXXXXX").string();
  if (::mkdtemp(folder.data()) == nullptr) throw Error(folder, "cannot be made", "name a folder with --out");
  return folder;
}

const char* process_name(std::int32_t process) {
  switch (process) {
    case heartbeat_t::BRIDGE:
      return "imrig-bridge";
    case heartbeat_t::DYNO:
      return "imrig-dyno";
    case heartbeat_t::RECORDER:
      return "imrig-recorder";
    case heartbeat_t::ESTIMATOR:
      return "imrig-estimator";
    default:
      return "a process";
  }
}

// What the bus says about the rig's health, told once at each change.
class Watch {
 public:
  Watch(Bus& bus, const RigConfig& rig) : rig_(rig), since_us_(monotonic_us()) {
    subscribe<heartbeat_t>(bus, channel::kHeartbeat, [this](const heartbeat_t& h) {
      if (const auto found = heard_us_.find(h.process); found != heard_us_.end())
        found->second = monotonic_us();
    });
    subscribe<bridge_status_t>(bus, channel::kBridgeStatus, [this](const bridge_status_t& s) {
      link("DSP link", rig_.bridge.link, s.link_state == bridge_status_t::LINK_UP, "no DSP answers", dsp_);
      trip("imrig-bridge", s.trip, bridge_trip_);
    });
    subscribe<dyno_status_t>(bus, channel::kDynoStatus, [this](const dyno_status_t& s) {
      link("Modbus", rig_.dyno.link, s.link_state == dyno_status_t::LINK_UP, "no excitation supply answers",
           supply_);
      trip("imrig-dyno", s.trip, dyno_trip_);
    });
  }

  // A sentence when a process does not speak on the bus any more.
  std::string silent() const {
    const std::int64_t now_us = monotonic_us();
    for (const auto& [process, heard_us] : heard_us_)
      if (now_us - since_us_ > kFirstWords_us && now_us - std::max(heard_us, since_us_) > kSilence_us)
        return fmt::format("{} is silent on the bus", process_name(process));
    return "";
  }

 private:
  void link(const char* what, const std::string& url, bool up, const char* missing,
            std::optional<bool>& known) {
    if (!up && !known && monotonic_us() - since_us_ < kFirstWords_us / 2) return;  // still saying hello
    if (known == up) return;
    if (up) fmt::print("{}: up at {}\n", what, url);
    if (!up) fmt::print("warning: {} at {}; the rig is degraded until one does\n", missing, url);
    std::fflush(stdout);
    known = up;
  }
  void trip(const char* who, std::int32_t trip, std::int32_t& known) {
    if (trip == known) return;
    known = trip;
    if (trip != 0) fmt::print("{} tripped: {}\n", who, trip_name(static_cast<Trip>(trip)));
    if (trip == 0) fmt::print("{}: reset\n", who);
    std::fflush(stdout);
  }

  const RigConfig& rig_;
  std::int64_t since_us_;
  std::map<std::int32_t, std::int64_t> heard_us_ = {{heartbeat_t::BRIDGE, 0},
                                                    {heartbeat_t::DYNO, 0},
                                                    {heartbeat_t::RECORDER, 0},
                                                    {heartbeat_t::ESTIMATOR, 0}};
  std::optional<bool> dsp_;
  std::optional<bool> supply_;
  std::int32_t bridge_trip_ = 0;
  std::int32_t dyno_trip_ = 0;
};

void print_rig(const RigProcesses& rig, const std::string& folder) {
  for (const auto& child : rig.children())
    fmt::print("{:<16} pid {:<8} log {}\n", child->name(), child->pid(), child->log_path());
  fmt::print(
      "bus              {}\nDSP link         {}\nModbus           {}\nevent log        "
      "{}/rig.lcm\nconfiguration    {}\n",
      rig.rig().bus.url, rig.rig().bridge.link, rig.rig().dyno.link, folder, rig.rig_path());
  fmt::print("up; other commands: imrig status --config {}; Ctrl-C stops the rig safely\n", rig.rig_path());
  std::fflush(stdout);
}

// Until Ctrl-C (empty), or the sentence why the rig cannot go on.
std::string watch(RigProcesses& rig) {
  const auto bus = open_lcm_bus(rig.rig().bus);
  Watch watch(*bus, rig.rig());
  while (!stop_asked()) {
    bus->wait(50);
    if (std::string fallen = rig.fallen(); !fallen.empty()) return fallen;
    if (std::string silent = watch.silent(); !silent.empty()) return silent;
  }
  return "";
}

// A rig that does not start leaves no temporary folder behind.
std::unique_ptr<RigProcesses> start_rig(const RigRequest& request, bool temporary) {
  try {
    return std::make_unique<RigProcesses>(request, stop_asked);
  } catch (...) {
    std::error_code ignored;
    if (temporary) std::filesystem::remove_all(request.folder, ignored);
    throw;
  }
}

int up(const Options& options) {
  catch_stop_signals();
  RigRequest request;
  if (!options.rig_path.empty()) request.rig = load_rig_config(options.rig_path);
  request.folder = make_run_folder(options.folder);
  request.rig_path = options.rig_path;
  request.rig_copy = request.folder + "/rig.toml";
  request.plant_path = options.plant_path;
  request.pace = options.pace;
  request.seed = options.seed;
  request.private_ports = !options.plant_path.empty() && options.rig_path.empty();
  request.recorder_out = request.folder + "/rig.lcm";
  const auto rig = start_rig(request, options.folder.empty());
  std::string problem;
  if (!stop_asked()) {
    print_rig(*rig, request.folder);
    problem = watch(*rig);
  }
  if (!problem.empty()) fmt::print(stderr, "imrig: {}; stopping the rig\n", problem);
  for (const std::string& name : rig->stop()) fmt::print(stderr, "imrig: {} had to be killed\n", name);
  fmt::print("stopped\n");
  return problem.empty() ? 0 : 1;
}

}  // namespace

void add_up(CLI::App& app, int& exit_code) {
  CLI::App* verb = app.add_subcommand("up", "start the rig's processes; Ctrl-C stops them safely");
  const auto options = std::make_shared<Options>();
  verb->add_option("--config", options->rig_path,
                   "rig configuration (default: the built-in one; with --emulate, private free ports)");
  CLI::Option* emulate =
      verb->add_option("--emulate", options->plant_path, "emulate this plant (TOML) instead of hardware");
  verb->add_option("--pace", options->pace, "of the emulator: realtime, a factor, or max")
      ->capture_default_str()
      ->needs(emulate);
  verb->add_option("--seed", options->seed, "of the emulator's noise and tolerances")->needs(emulate);
  verb->add_option("--out", options->folder,
                   "folder for the event log and the processes' logs (default: a temporary one)");
  verb->callback([options, &exit_code] { exit_code = up(*options); });
}

}  // namespace imrig
