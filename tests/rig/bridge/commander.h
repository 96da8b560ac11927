#pragma once
// Somebody at the bus who takes the lease and commands: a LeaseClient on real LCM, and everything the bridge
// said.

#include <functional>
#include <imrig_msg/bridge_cmd_t.hpp>
#include <imrig_msg/bridge_status_t.hpp>
#include <imrig_msg/heartbeat_t.hpp>
#include <imrig_msg/lease_t.hpp>
#include <memory>
#include <optional>

#include "rig/bus/bus.h"
#include "rig/safety/command_result.h"
#include "rig/safety/lease_client.h"

namespace imrig {

class Commander {
 public:
  explicit Commander(const RigConfig& rig);
  Commander(const Commander&) = delete;
  Commander& operator=(const Commander&) = delete;

  // Works the bus until reached(), at most so long. Returns whether it was reached.
  bool until(const std::function<bool()>& reached, int at_most_ms = 20'000);
  bool take_lease();
  CommandResult send(imrig_msg::bridge_cmd_t& cmd, std::int32_t ttl_ms = 5000);
  CommandResult act(std::int32_t action, std::int32_t profile_id = 0);
  // Lease, upload of one long voltage segment, start.
  bool drive(std::int32_t profile_id = 1);
  void estop();

  const std::optional<imrig_msg::bridge_status_t>& status() const { return status_; }
  bool is(std::int32_t run_state) const { return status_ && status_->run_state == run_state; }

  std::unique_ptr<Bus> bus;
  LeaseClient lease;
  std::optional<imrig_msg::heartbeat_t> heartbeat;  // the bridge's last

 private:
  void turn();

  std::optional<imrig_msg::bridge_status_t> status_;
  std::optional<std::pair<std::int64_t, std::int64_t>>
      awaited_;  // epoch and sequence of the command that was sent
  std::optional<CommandResult> answer_;
};

// A rig of its own: free bus port, the device at this address.
RigConfig test_rig(const std::string& link_url);

}  // namespace imrig
