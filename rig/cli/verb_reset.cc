// imrig reset: clears the trips of bridge and dyno, with a lease of its own for each. Starts nothing.

#include <fmt/format.h>

#include <imrig_msg/bridge_cmd_t.hpp>
#include <imrig_msg/dyno_cmd_t.hpp>
#include <memory>

#include "rig/base/clock.h"
#include "rig/base/rig_config.h"
#include "rig/bus/channels.h"
#include "rig/cli/rig_watch.h"
#include "rig/cli/verbs.h"
#include "rig/safety/command_result.h"
#include "rig/safety/lease_client.h"
#include "rig/safety/trip.h"

namespace imrig {

namespace {

using imrig_msg::bridge_cmd_t;
using imrig_msg::dyno_cmd_t;
using imrig_msg::heartbeat_t;

constexpr int kListen_ms = 600;
constexpr int kAnswer_ms = 5000;

Moment now() { return {monotonic_us(), wall_us()}; }

// One actuator: lease, RESET, answer, release.
class Reset {
 public:
  Reset(Bus& bus, RigWatch& rig, const LimitsConfig& limits, bool bridge)
      : bus_(bus),
        rig_(rig),
        bridge_(bridge),
        lease_ms_(limits.lease_ms),
        lease_(bridge ? +heartbeat_t::BRIDGE : +heartbeat_t::DYNO, random_id(),
               std::int64_t{limits.lease_ms} * 1000) {}

  // Empty when it is done, else why not.
  std::string run() {
    lease_.acquire();
    const bool got = rig_.listen(
        lease_ms_ + 1000, [this] { return lease_.held(); }, [this] { turn(); });
    if (!got) return lease_.other_holder() != 0 ? "somebody else commands it" : "it grants no lease";
    const std::string why = bridge_ ? command<bridge_cmd_t>() : command<dyno_cmd_t>();
    lease_.release();
    turn();
    return why;
  }

 private:
  void turn() {
    const auto& status = bridge_ ? rig_.bridge_lease : rig_.dyno_lease;
    if (status && status->seq != heard_) lease_.on_lease(*status, now());
    if (status) heard_ = status->seq;
    if (const auto cmd = lease_.step(now())) publish(bus_, channel::kLeaseCmd, *cmd);
  }

  template <class Command>
  std::string command() {
    Command cmd = {};
    if constexpr (std::is_same_v<Command, bridge_cmd_t>) {
      cmd.bridge_cmd_v1 = 1;
    } else {
      cmd.dyno_cmd_v1 = 1;
    }
    cmd.action = Command::RESET;
    lease_.sign(cmd, now(), kAnswer_ms);
    publish(bus_, bridge_ ? channel::kBridgeCmd : channel::kDynoCmd, cmd);
    CommandResult result = CommandResult::kPending;
    const auto answered = [&] {
      if (rig_.bridge && bridge_) result = result_of(*rig_.bridge, cmd);
      if (rig_.dyno && !bridge_) result = result_of(*rig_.dyno, cmd);
      return result != CommandResult::kPending;
    };
    if (!rig_.listen(kAnswer_ms, answered, [this] { turn(); })) return "no answer";
    return result == CommandResult::kDone ? "" : std::string(result_name(result));
  }

  template <class Status, class Command>
  static CommandResult result_of(const Status& status, const Command& cmd) {
    const bool ours = status.last_cmd_epoch == cmd.lease_epoch && status.last_cmd_seq == cmd.seq;
    return ours ? static_cast<CommandResult>(status.last_cmd_result) : CommandResult::kPending;
  }

  Bus& bus_;
  RigWatch& rig_;
  bool bridge_;
  int lease_ms_;
  LeaseClient lease_;
  std::int64_t heard_ = 0;
};

bool reset_one(Bus& bus, RigWatch& rig, const LimitsConfig& limits, bool bridge) {
  const char* name = bridge ? "imrig-bridge" : "imrig-dyno";
  const std::int32_t trip = bridge ? rig.bridge->trip : rig.dyno->trip;
  const std::string why = Reset(bus, rig, limits, bridge).run();
  if (why.empty()) {
    fmt::print("{}: {}\n", name, trip == 0 ? "was not tripped" : "reset");
    return true;
  }
  fmt::print(stderr, "imrig: {} refused the reset: {} (trip: {})\n", name, why,
             trip_name(static_cast<Trip>(trip)));
  return false;
}

int run(const std::string& config_path) {
  const RigConfig config = config_path.empty() ? RigConfig{} : load_rig_config(config_path);
  const auto bus = open_lcm_bus(config.bus);
  RigWatch rig(*bus);
  rig.listen(kListen_ms, [&] { return rig.bridge && rig.dyno; });
  if (!rig.anybody()) {
    fmt::print(stderr, "imrig: no rig is alive on {}\n", config.bus.url);
    return 1;
  }
  bool done = true;
  if (rig.bridge) done = reset_one(*bus, rig, config.limits, true) && done;
  if (rig.dyno) done = reset_one(*bus, rig, config.limits, false) && done;
  return done ? 0 : 1;
}

}  // namespace

void add_reset(CLI::App& app, int& exit_code) {
  const auto config = std::make_shared<std::string>();
  CLI::App* verb =
      app.add_subcommand("reset", "Clear the trips of bridge and dyno; 1 with the reason when one refuses");
  verb->add_option("--config", *config, "rig.toml, for the bus and the lease time");
  verb->callback([config, &exit_code] { exit_code = run(*config); });
}

}  // namespace imrig
