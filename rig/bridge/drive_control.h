#pragma once
// The motor drive as the bridge runs it: what was ordered (StopMachine), what the device says (its status),
// and the orders that bring the two together.
//
// The device may drive only after an order of ours. It is ordered to open its gates, again and again until it
// says it has, whenever we are tripped or it drives without an order. A status that was on its way while an
// order went out says nothing about the order: IDLE and HOLDING count only once the order is answered and the
// device has been seen to move on, or 20 ms of device time have passed.

#include <cstdint>
#include <optional>

#include "rig/link/host.h"
#include "rig/safety/command_result.h"
#include "rig/safety/stop_machine.h"

namespace imrig {

class DriveControl {
 public:
  static constexpr double kRamp_s = 0.3;  // of a stop, device time
  static constexpr std::int64_t kStopPatience_us =
      10'000'000;  // host time; an emulator may be slower than real time

  explicit DriveControl(LinkHost& link) : link_(link) {}

  // Orders. start() and stop() return the link's request number, 0 when the state does not allow the order.
  std::int64_t start(std::int32_t profile_id);
  std::int64_t stop();
  void trip(Trip cause);
  std::int64_t
  clear();  // first half of a reset; the second is the device's answer. 0 when there is nothing to clear

  // What the link tells.
  void on_welcome(const LinkWelcome& welcome);
  void on_status(const imrig_status& status);
  void on_answer(const LinkAnswer& answer);
  void on_down();
  // Timers; at least every 20 ms.
  void poll(std::int64_t now_us);

  StopState state() const { return machine_.state(); }
  Trip cause() const { return machine_.cause(); }
  bool may_drive() const { return machine_.may_drive(); }
  // The link is up and the device itself says that its gates are off and will stay off.
  bool gates_known_off() const;
  bool clearing() const { return clear_request_ != 0; }
  const std::optional<imrig_status>& device() const { return status_; }  // last status of this boot
  std::int32_t profile_id() const { return may_drive() ? profile_id_ : 0; }

 private:
  void follow(const imrig_status& status);
  void start_answered(std::int32_t result);
  void stop_answered(std::int32_t result);
  void clear_answered(std::int32_t result);
  void insist_on_gates_off();

  LinkHost& link_;
  StopMachine machine_;
  std::optional<imrig_status> status_;
  std::optional<std::int32_t>
      device_state_;             // as its last status or its last answer says; empty: it has yet to say
  std::int32_t profile_id_ = 0;  // running or holding
  std::int32_t starting_id_ = 0;
  std::int64_t start_request_ = 0;  // unanswered; 0 none
  std::int64_t stop_request_ = 0;
  std::int64_t trip_request_ = 0;
  std::int64_t clear_request_ = 0;
  std::int64_t settled_utime_ = 0;  // device time from which IDLE and HOLDING count
  bool seen_driving_ = false;       // since the last start was answered
  std::int64_t stop_us_ = -1;       // since when it has been stopping; -1: it is not
};

}  // namespace imrig
