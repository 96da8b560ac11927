// imrig replay LOG: plays an event log back onto a bus that nobody lives on.

#include <cstdio>
#include <imrig_msg/heartbeat_t.hpp>
#include <limits>
#include <memory>
#include <string>

#include "rig/base/error.h"
#include "rig/base/rig_config.h"
#include "rig/base/stop_signal.h"
#include "rig/bus/replay.h"
#include "rig/cli/verbs.h"

namespace imrig {

namespace {

constexpr int kListen_ms = 700;  // three heartbeats

struct Options {
  std::string log;
  std::string speed = "1";
  std::string config;
  std::string url;
  bool followers = false;
};

double speed_of(const std::string& text) {
  if (text == "max") return std::numeric_limits<double>::infinity();
  std::size_t used = 0;
  double speed = 0.0;
  try {
    speed = std::stod(text, &used);
  } catch (const std::exception&) {
    used = 0;
  }
  if (used != text.size() || !(speed > 0.0) || !(speed <= 1e6)) {
    throw Error("--speed", "is " + text, "a number above 0, or max");
  }
  return speed;
}

BusConfig bus_of(const Options& options) {
  BusConfig bus;
  if (!options.config.empty()) bus = load_rig_config(options.config).bus;
  if (!options.url.empty()) bus.url = options.url;
  return bus;
}

bool only_listens(const LiveProcess& p) {
  return p.process == imrig_msg::heartbeat_t::RECORDER || p.process == imrig_msg::heartbeat_t::ESTIMATOR;
}

// A bus of its own: it is closed, with its subscription, before anything is played.
bool somebody_lives_on(const BusConfig& config, bool followers) {
  auto live = live_heartbeats(*open_lcm_bus(config), kListen_ms);
  if (followers) std::erase_if(live, only_listens);
  if (live.empty()) return false;
  const auto& first = live.front();
  std::fprintf(stderr,
               "imrig: %s is alive on %s (%s, pid %d%s): nothing is replayed onto a live bus; choose another "
               "port with --url\n",
               process_name(first.process).c_str(), config.url.c_str(), first.channel.c_str(), first.pid,
               live.size() > 1 ? ", and others" : "");
  return true;
}

int run(const Options& options) {
  const double speed = speed_of(options.speed);
  EventLogReader log(options.log);  // a bad file is told before anything is heard or sent
  const BusConfig config = bus_of(options);
  if (somebody_lives_on(config, options.followers)) return 1;
  const auto bus = open_lcm_player(config);
  catch_stop_signals();
  ReplayOptions pace;
  pace.speed = speed;
  pace.keep_going = [] { return !stop_asked(); };
  const ReplayReport report = replay(log, bus, pace);
  std::printf("played %lld messages, left out %lld commands%s%s\n", static_cast<long long>(report.played),
              static_cast<long long>(report.commands_left_out), report.stopped ? ", stopped" : "",
              log.torn() ? ", the log's tail is torn" : "");
  return 0;
}

}  // namespace

void add_replay(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<Options>();
  CLI::App* verb = app.add_subcommand(
      "replay", "Play a log back onto the bus, without its commands; refuses a bus with live heartbeats");
  verb->add_option("log", options->log, "LCM event log")->required();
  verb->add_option("--speed", options->speed,
                   "log time over wall time, or max (at most 20000 messages a second)")
      ->capture_default_str();
  verb->add_option("--config", options->config, "rig.toml, for the bus");
  verb->add_option("--url", options->url, "LCM URL, before the configuration's");
  verb->add_flag("--followers", options->followers,
                 "recorder and estimator may be alive there: they only listen");
  verb->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace imrig
