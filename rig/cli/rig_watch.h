#pragma once
// What the bus says about a rig right now: the last message of each kind, and who is alive. For the verbs
// that look at a rig or act on it.

#include <cstdint>
#include <functional>
#include <imrig_msg/bridge_status_t.hpp>
#include <imrig_msg/campaign_status_t.hpp>
#include <imrig_msg/dyno_status_t.hpp>
#include <imrig_msg/heartbeat_t.hpp>
#include <imrig_msg/lease_t.hpp>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "rig/bus/bus.h"

namespace imrig {

class RigWatch {
 public:
  explicit RigWatch(Bus& bus);
  RigWatch(const RigWatch&) = delete;
  RigWatch& operator=(const RigWatch&) = delete;

  // Listens until reached() or for at_most_ms of wall time; calls each_turn about every 20 ms. Returns
  // whether reached() came true.
  bool listen(int at_most_ms, const std::function<bool()>& reached,
              const std::function<void()>& each_turn = {});

  std::map<std::pair<std::int32_t, std::int64_t>, imrig_msg::heartbeat_t>
      processes;  // by process and instance
  std::optional<imrig_msg::bridge_status_t> bridge;
  std::optional<imrig_msg::dyno_status_t> dyno;
  std::optional<imrig_msg::lease_t> bridge_lease;
  std::optional<imrig_msg::lease_t> dyno_lease;
  std::optional<imrig_msg::campaign_status_t> campaign;

  // The actuators that speak: their status was heard.
  bool anybody() const { return bridge || dyno; }

 private:
  Bus& bus_;
};

// The bus of a rig.toml, or the default bus when the path is empty. Throws Error.
BusConfig bus_of_rig(const std::string& config_path);

std::string link_word(std::int32_t link_state);  // of bridge_status_t and dyno_status_t: absent, up, silent
std::string drive_word(std::int32_t run_state);  // of bridge_status_t
std::string load_word(std::int32_t run_state);   // of dyno_status_t
std::string health_word(std::int32_t heartbeat_state);  // of heartbeat_t

}  // namespace imrig
