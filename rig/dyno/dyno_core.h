#pragma once
// The load's controller: who may command it, what the excitation supply is told, and when it is switched off.
// docs/dyno.md.
//
//   OFF --SET--> ON --OFF--> OFF        SET in ON moves the target
//   any --trip--> TRIPPED --RESET--> OFF    the first cause stays
//
// Set-points of the three modes; the supply holds whichever of its two limits is reached first:
//   VOLTAGE        set_V ramps to the target, set_A = max_A
//   FIELD_CURRENT  set_A ramps to the target, set_V = max_V
//   SHAFT_TORQUE   set_A follows the field current that gives the target at the measured speed, set_V = max_V
// Ramps run in rig time; before the first sample, in host time. OFF and every trip: output off, set-points
// zero, at once.
//
// No I/O, no clock: mains hand in messages, time and the supply's reports. All calls from one thread.

#include <cstdint>
#include <imrig_msg/dyno_cmd_t.hpp>
#include <imrig_msg/dyno_status_t.hpp>
#include <imrig_msg/estop_cmd_t.hpp>
#include <imrig_msg/heartbeat_t.hpp>
#include <imrig_msg/lease_cmd_t.hpp>
#include <imrig_msg/lease_t.hpp>
#include <imrig_msg/samples_t.hpp>

#include "rig/base/rig_config.h"
#include "rig/dyno/ramp.h"
#include "rig/dyno/shaft_speed.h"
#include "rig/dyno/supply.h"
#include "rig/safety/command_guard.h"
#include "rig/safety/lease_authority.h"
#include "rig/safety/peer_watch.h"
#include "rig/safety/trip.h"

namespace imrig {

struct DynoCoreConfig {
  DynoConfig dyno;
  LimitsConfig limits;
  GeneratorConfig generator;
  bool can_set_V = true;  // of the register map
  bool can_set_A = true;
  double resolution_A = 0.001;  // of the current set-point: smaller changes are not worth a write
};

class DynoCore {
 public:
  // random_id: as LeaseAuthority's.
  DynoCore(const DynoCoreConfig& config, LeaseAuthority::RandomId random_id);

  void on_command(const imrig_msg::dyno_cmd_t& command, Moment now);
  bool on_lease(const imrig_msg::lease_cmd_t& request, Moment now);  // true: publish lease() at once
  void on_estop(const imrig_msg::estop_cmd_t& estop, Moment now);
  void on_heartbeat(const imrig_msg::heartbeat_t& heartbeat, Moment now);
  void on_samples(const imrig_msg::samples_t& samples);
  void on_supply(const SupplyReport& report, Moment now);

  // Lets time pass, at least every 20 ms. Returns what the supply is to be told; its number rises when it
  // changes.
  SupplyOrder step(Moment now);

  // The process ends: off, and nothing is taken any more.
  void stop();
  bool supply_is_off() const;  // the supply has said so since the last change

  // seq is the caller's to fill.
  imrig_msg::dyno_status_t status(Moment now) const;
  imrig_msg::lease_t lease(Moment now) const;
  std::int32_t heartbeat_state() const;  // heartbeat_t's constant
  Trip trip() const { return trip_; }
  std::int64_t rig_utime() const { return speed_.utime(); }

 private:
  // Which clock the ramps run in.
  struct Clock {
    bool rig = false;
    std::int64_t boot_id = 0;
    bool operator==(const Clock&) const = default;
  };

  CommandResult carry_out(const imrig_msg::dyno_cmd_t& command, Moment now);
  CommandResult check_set(const imrig_msg::dyno_cmd_t& command) const;
  CommandResult set(const imrig_msg::dyno_cmd_t& command, Moment now);
  CommandResult reset(Moment now);
  double greatest_value(std::int32_t mode) const;
  double greatest_rate(std::int32_t mode) const;
  double most_A() const;
  double measured_start(std::int32_t mode) const;
  void switch_off();
  void trip(Trip cause);
  void look_for_trips(Moment now);
  bool supply_silent(Moment now) const;
  Trip supply_trip(Moment now) const;
  double passed_s(Moment now);
  void follow_target(double dt_s);
  double follow_torque(double dt_s);
  bool at_target() const;
  std::int32_t run_state() const;

  DynoCoreConfig config_;
  LeaseAuthority lease_;
  CommandGuard guard_;
  PeerWatch bridge_;
  ShaftSpeed speed_;
  SupplyReport supply_;
  Clock clock_;
  std::int64_t clock_us_ = 0;
  Trip trip_ = Trip::kNone;
  bool on_ = false;
  bool stopping_ = false;
  std::int32_t mode_ = 0;
  double target_ = 0.0;  // in the mode's unit
  Ramp ramp_;            // in the mode's unit
  Ramp field_A_;         // SHAFT_TORQUE: the current that follows
  double wanted_A_ = 0.0;
  SupplyOrder next_;              // being put together
  SupplyOrder order_;             // as of the last step
  std::int64_t on_order_ = 0;     // first order with the output on: older reports say nothing about it
  std::int64_t on_since_us_ = 0;  // steady
  std::int64_t last_epoch_ = 0;
  std::int64_t last_seq_ = 0;
  CommandResult last_result_ = CommandResult::kDone;
};

}  // namespace imrig
