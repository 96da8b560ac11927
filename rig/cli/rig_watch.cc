#include "rig/cli/rig_watch.h"

#include "rig/base/clock.h"
#include "rig/base/rig_config.h"
#include "rig/bus/channels.h"

namespace imrig {

namespace {

constexpr int kTurn_ms = 20;

template <class Message>
void keep(Bus& bus, const char* name, std::optional<Message>& last) {
  subscribe<Message>(bus, name, [&last](const Message& message) { last = message; });
}

std::string word_of(std::int32_t value, std::initializer_list<const char*> words) {
  const bool known = value >= 0 && static_cast<std::size_t>(value) < words.size();
  return known ? words.begin()[value] : "unknown (" + std::to_string(value) + ")";
}

}  // namespace

RigWatch::RigWatch(Bus& bus) : bus_(bus) {
  subscribe<imrig_msg::heartbeat_t>(bus, channel::kHeartbeat, [this](const auto& h) {
    processes[{h.process, h.instance}] = h;
  });
  keep(bus, channel::kBridgeStatus, bridge);
  keep(bus, channel::kDynoStatus, dyno);
  keep(bus, channel::kBridgeLease, bridge_lease);
  keep(bus, channel::kDynoLease, dyno_lease);
  keep(bus, channel::kCampaignStatus, campaign);
}

bool RigWatch::listen(int at_most_ms, const std::function<bool()>& reached,
                      const std::function<void()>& each_turn) {
  const std::int64_t end_us = monotonic_us() + std::int64_t{at_most_ms} * 1000;
  do {
    if (each_turn) each_turn();
    bus_.wait(kTurn_ms);
    if (reached()) return true;
  } while (monotonic_us() < end_us);
  return false;
}

BusConfig bus_of_rig(const std::string& config_path) {
  return config_path.empty() ? BusConfig{} : load_rig_config(config_path).bus;
}

std::string link_word(std::int32_t link_state) { return word_of(link_state, {"absent", "up", "silent"}); }
std::string drive_word(std::int32_t run_state) {
  return word_of(run_state, {"idle", "running", "holding", "stopping", "tripped"});
}
std::string load_word(std::int32_t run_state) { return word_of(run_state, {"off", "on", "tripped"}); }
std::string health_word(std::int32_t heartbeat_state) {
  return word_of(heartbeat_state, {"starting", "ok", "degraded", "tripped", "stopping"});
}

}  // namespace imrig
