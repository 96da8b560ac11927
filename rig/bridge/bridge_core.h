#pragma once
// The bridge between DSP link and bus, as a core: bytes and messages in, packets and messages out, time
// handed in. No I/O.
//
// Upwards it republishes every block as SAMPLES, unchanged; downwards it carries out the commands of the
// lease holder. The rig trips, which opens the gates at once, on: ESTOP; a limit in the samples; a silent
// link, a lost lease, a rebooted device or a stop that does not end while driving; the device's own trips;
// the dyno's silence or trip while driving, once a dyno has been seen; lost blocks. It never starts or
// resumes anything by itself. docs/safety.md tells all of it.
//
// Use: on_*() for whatever came, then poll(), then take next_packet() and next_message() until there are
// none.

#include <cstdint>
#include <deque>
#include <functional>
#include <imrig_msg/ack_t.hpp>
#include <imrig_msg/bridge_cmd_t.hpp>
#include <imrig_msg/bridge_status_t.hpp>
#include <imrig_msg/estop_cmd_t.hpp>
#include <imrig_msg/heartbeat_t.hpp>
#include <imrig_msg/lease_cmd_t.hpp>
#include <imrig_msg/lease_t.hpp>
#include <imrig_msg/samples_t.hpp>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "rig/base/rig_config.h"
#include "rig/bridge/credit_keeper.h"
#include "rig/bridge/drive_control.h"
#include "rig/link/host.h"
#include "rig/safety/command_guard.h"
#include "rig/safety/lease_authority.h"
#include "rig/safety/limits.h"
#include "rig/safety/moment.h"
#include "rig/safety/peer_watch.h"

namespace imrig {

using BridgeMessage = std::variant<imrig_msg::samples_t, imrig_msg::bridge_status_t, imrig_msg::lease_t,
                                   imrig_msg::heartbeat_t>;

class BridgeCore {
 public:
  // Longest time from shut_down() to finished(), host time: ramp down, then gates off at once, then give up
  // (the device's watchdog is left).
  static constexpr std::int64_t kShutDownRamp_us = 2'000'000;
  static constexpr std::int64_t kShutDown_us = 3'000'000;

  BridgeCore(const RigConfig& config, std::int32_t pid, LeaseAuthority::RandomId random_id);
  BridgeCore(const BridgeCore&) = delete;
  BridgeCore& operator=(const BridgeCore&) = delete;

  void on_link_bytes(std::span<const std::uint8_t> bytes, Moment now);
  void on_lease_cmd(const imrig_msg::lease_cmd_t& cmd, Moment now);
  void on_bridge_cmd(const imrig_msg::bridge_cmd_t& cmd, Moment now);
  void on_estop(const imrig_msg::estop_cmd_t& cmd, Moment now);
  void on_heartbeat(const imrig_msg::heartbeat_t& heartbeat, Moment now);
  void on_ack(const imrig_msg::ack_t& ack, Moment now);
  // Timers: link, lease, peer, status, heartbeat. At least every 10 ms, and after every batch of the above.
  void poll(Moment now);

  bool next_packet(std::vector<std::uint8_t>& packet) { return link_.next_output(packet); }
  // Hands over the messages for the bus, oldest first, and forgets them.
  void take_messages(const std::function<void(const BridgeMessage&)>& sink);

  // The process wants to end: stop the motor, take no more commands. Then go on polling until finished().
  void shut_down(Moment now);
  bool finished(Moment now) const;

  StopState state() const { return drive_.state(); }
  Trip cause() const { return drive_.cause(); }

 private:
  struct LastCommand {
    std::int64_t epoch = 0, seq = 0;
    CommandResult result = CommandResult::kDone;
    bool operator==(const LastCommand&) const = default;
  };
  struct Pending {  // a command that waits for the device
    std::int64_t request = 0;
    std::int32_t action = 0;
    std::int32_t profile_id = 0;
  };
  // What makes a status be published at once when it changes.
  struct Visible {
    std::int32_t link_state = 0;
    StopState state = StopState::kIdle;
    Trip cause = Trip::kNone;
    std::int32_t profile_id = 0, loaded = 0;
    LastCommand last;
    bool operator==(const Visible&) const = default;
  };

  void take_link_events(Moment now);
  void on_event(const LinkWelcome& welcome, Moment now);
  void on_event(const LinkBlock& block, Moment now);
  void on_event(const LinkStatus& status, Moment now);
  void on_event(const LinkAnswer& answer, Moment now);
  void on_event(const LinkDown& down, Moment now);

  CommandResult carry_out(const imrig_msg::bridge_cmd_t& cmd, Moment now);
  CommandResult upload(const imrig_msg::bridge_cmd_t& cmd);
  CommandResult start(const imrig_msg::bridge_cmd_t& cmd, Moment now);
  CommandResult stop(const imrig_msg::bridge_cmd_t& cmd);
  CommandResult reset(const imrig_msg::bridge_cmd_t& cmd, Moment now);
  CommandResult pend(std::int64_t request, const imrig_msg::bridge_cmd_t& cmd);
  void answer_pending(const LinkAnswer& answer);
  void settle_pending();

  void watch_lease(Moment now);
  void watch_dyno(Moment now);
  void watch_shut_down(Moment now);
  void grant_credit(Moment now, std::int64_t at_least);
  std::int32_t link_state() const;
  Visible visible() const;
  void publish_if_changed(Moment now);
  void publish_due(Moment now);
  void publish_status(Moment now, const LastCommand& last);
  void publish_lease(Moment now);
  void publish_heartbeat(Moment now);
  std::int64_t rig_utime() const;

  RigConfig config_;
  std::int32_t pid_;
  std::int64_t instance_;
  LinkHost link_;
  DriveControl drive_;
  LeaseAuthority lease_;
  CommandGuard guard_;
  LimitMonitor monitor_;
  PeerWatch dyno_;
  CreditKeeper credit_;
  std::deque<BridgeMessage> messages_;

  LastCommand last_;
  std::optional<Pending> pending_;
  std::int32_t loaded_ = 0;       // uploaded in this lease, not yet started
  BlockExtremes extremes_;        // of the last block
  double current_peak_A_ = 0.0;   // since the last status
  std::int64_t lost_before_ = 0;  // blocks lost before the motor was started
  std::int64_t granted_ = 0;
  std::optional<std::int64_t> shut_down_us_;

  Visible shown_;
  std::int64_t next_status_us_ = 0, next_lease_us_ = 0, next_heartbeat_us_ = 0;
  std::int64_t status_seq_ = 0, lease_seq_ = 0, heartbeat_seq_ = 0;
};

}  // namespace imrig
