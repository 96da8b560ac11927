#include "rig/dyno/dyno_core.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "rig/base/generator.h"
#include "rig/base/space_vector.h"
#include "rig/dyno/excitation_model.h"

namespace imrig {

using imrig_msg::dyno_cmd_t;
using imrig_msg::dyno_status_t;
using imrig_msg::heartbeat_t;

namespace {

// A torque set-point follows the speed; the current is written anew when it is off by more than this.
constexpr double kFollowFraction = 0.002;
constexpr double kTorqueTolerance = 0.01;  // at target
constexpr double kUnlimited = 1e12;        // N m/s

bool is_mode(std::int32_t mode) {
  return mode == dyno_cmd_t::VOLTAGE || mode == dyno_cmd_t::FIELD_CURRENT || mode == dyno_cmd_t::SHAFT_TORQUE;
}

}  // namespace

DynoCore::DynoCore(const DynoCoreConfig& config, LeaseAuthority::RandomId random_id)
    : config_(config),
      lease_(heartbeat_t::DYNO, std::int64_t{1000} * config.limits.lease_ms, std::move(random_id)),
      bridge_(heartbeat_t::BRIDGE, std::int64_t{1000} * config.limits.peer_silence_ms) {}

bool DynoCore::on_lease(const imrig_msg::lease_cmd_t& request, Moment now) {
  return lease_.request(request, now);
}

void DynoCore::on_heartbeat(const heartbeat_t& heartbeat, Moment now) {
  bridge_.on_heartbeat(heartbeat, now);
}

void DynoCore::on_samples(const imrig_msg::samples_t& samples) { speed_.take(samples); }

void DynoCore::on_estop(const imrig_msg::estop_cmd_t& estop, Moment now) {
  if (in_time(estop.issued_host_utime, estop.ttl_ms, now)) trip(Trip::kOperatorStop);
}

void DynoCore::on_supply(const SupplyReport& report, Moment now) {
  supply_ = report;
  look_for_trips(now);
}

void DynoCore::on_command(const dyno_cmd_t& command, Moment now) {
  look_for_trips(now);
  last_epoch_ = command.lease_epoch;
  last_seq_ = command.seq;
  last_result_ = guard_.check(stamp_of(command), lease_.epoch(), now);
  if (last_result_ == CommandResult::kDone) last_result_ = carry_out(command, now);
}

CommandResult DynoCore::carry_out(const dyno_cmd_t& command, Moment now) {
  switch (command.action) {
    case dyno_cmd_t::OFF:
      switch_off();
      return CommandResult::kDone;
    case dyno_cmd_t::RESET:
      return reset(now);
    case dyno_cmd_t::SET:
      return set(command, now);
    default:
      return CommandResult::kMalformed;
  }
}

CommandResult DynoCore::check_set(const dyno_cmd_t& command) const {
  if (!is_mode(command.mode) || !std::isfinite(command.value) || command.value < 0.0)
    return CommandResult::kMalformed;
  if (!std::isnan(command.ramp_per_s) && !(command.ramp_per_s > 0.0)) return CommandResult::kMalformed;
  if (command.mode == dyno_cmd_t::VOLTAGE ? !config_.can_set_V : !config_.can_set_A)
    return CommandResult::kMalformed;
  if (trip_ != Trip::kNone) return CommandResult::kTripped;
  if (stopping_) return CommandResult::kBusy;
  if (supply_.link != SupplyLink::kUp || supply_.wrong_device) return CommandResult::kLinkAbsent;
  if (command.mode == dyno_cmd_t::SHAFT_TORQUE && std::isnan(speed_.rpm())) return CommandResult::kLinkAbsent;
  const bool over =
      command.value > greatest_value(command.mode) || command.ramp_per_s > greatest_rate(command.mode);
  return over ? CommandResult::kOverLimit : CommandResult::kDone;
}

double DynoCore::greatest_value(std::int32_t mode) const {
  if (mode == dyno_cmd_t::VOLTAGE) return config_.dyno.max_V;
  if (mode == dyno_cmd_t::FIELD_CURRENT) return config_.dyno.max_A;
  return greatest_torque_Nm(config_.generator, most_A());
}

// Torque has no limit of its own: the field current that follows it has.
double DynoCore::greatest_rate(std::int32_t mode) const {
  if (mode == dyno_cmd_t::VOLTAGE) return config_.dyno.ramp_V_per_s;
  if (mode == dyno_cmd_t::FIELD_CURRENT) return config_.dyno.ramp_A_per_s;
  return kUnlimited;
}

CommandResult DynoCore::set(const dyno_cmd_t& command, Moment now) {
  if (const CommandResult no = check_set(command); no != CommandResult::kDone) return no;
  if (!on_ || command.mode != mode_) {
    ramp_.value = on_ ? measured_start(command.mode) : 0.0;
    field_A_.value = on_ ? measured_start(dyno_cmd_t::FIELD_CURRENT) : 0.0;
  }
  ramp_.rate_per_s = std::isnan(command.ramp_per_s) ? greatest_rate(command.mode) : command.ramp_per_s;
  field_A_.rate_per_s = config_.dyno.ramp_A_per_s;
  mode_ = command.mode;
  target_ = command.value;
  if (!on_) {
    on_ = true;
    on_since_us_ = now.steady_us;
    on_order_ = order_.number + 1;  // the next step's, at the earliest
  }
  return CommandResult::kDone;
}

// Where a ramp begins that takes over from another mode: where the supply is.
double DynoCore::measured_start(std::int32_t mode) const {
  const double field_A = std::isnan(supply_.out_A) ? order_.set_A : supply_.out_A;
  if (mode == dyno_cmd_t::VOLTAGE) {
    return std::clamp(std::isnan(supply_.out_V) ? order_.set_V : supply_.out_V, 0.0, config_.dyno.max_V);
  }
  if (mode == dyno_cmd_t::FIELD_CURRENT) return std::clamp(field_A, 0.0, config_.dyno.max_A);
  return shaft_torque_Nm(config_.generator, rad_s_of_rpm(speed_.rpm()), field_A);
}

CommandResult DynoCore::reset(Moment now) {
  if (trip_ == Trip::kNone) return CommandResult::kDone;
  // Only when the excitation is known to be gone.
  if (supply_.link != SupplyLink::kUp || supply_.wrong_device || supply_silent(now))
    return CommandResult::kLinkAbsent;
  if (next_ != order_ || supply_.order_number < order_.number) return CommandResult::kBusy;
  if (supply_.output_on) return CommandResult::kCauseRemains;
  bridge_.forget_if_silent(now);
  trip_ = Trip::kNone;
  return CommandResult::kDone;
}

void DynoCore::stop() {
  stopping_ = true;
  switch_off();
}

bool DynoCore::supply_is_off() const {
  return !next_.output_on && next_ == order_ && supply_.order_number == order_.number && !supply_.output_on;
}

void DynoCore::switch_off() {
  on_ = false;
  target_ = 0.0;
  ramp_.value = 0.0;
  field_A_.value = 0.0;
  next_ = SupplyOrder{0.0, 0.0, false, order_.number};
}

void DynoCore::trip(Trip cause) {
  switch_off();
  if (trip_ == Trip::kNone) trip_ = cause;
}

bool DynoCore::supply_silent(Moment now) const {
  const std::int64_t limit_us =
      std::int64_t{1000} * (config_.limits.link_silence_ms + 2 * config_.dyno.response_ms);
  return now.steady_us - std::max(supply_.heard_steady_us, on_since_us_) >= limit_us;
}

Trip DynoCore::supply_trip(Moment now) const {
  if (supply_.wrong_device) return Trip::kSupplyMismatch;
  if (supply_silent(now)) return Trip::kSupplySilent;
  // A report from before the output went on still shows the last protection trip.
  if (supply_.order_number < on_order_) return Trip::kNone;
  if (supply_.protection != 0) return Trip::kSupplyProtection;
  return supply_.mismatch ? Trip::kSupplyMismatch : Trip::kNone;
}

void DynoCore::look_for_trips(Moment now) {
  const LeaseEnd ended = lease_.step(now);
  const Trip peer = bridge_.check(now, on_);
  if (!on_) return;
  if (ended != LeaseEnd::kNone) return trip(Trip::kLeaseLost);
  if (peer != Trip::kNone) return trip(peer);
  if (const Trip supply = supply_trip(now); supply != Trip::kNone) trip(supply);
}

double DynoCore::most_A() const { return most_field_A(config_.generator, config_.dyno); }

void DynoCore::follow_target(double dt_s) {
  ramp_.advance(target_, dt_s);
  next_.output_on = true;
  next_.set_V = mode_ == dyno_cmd_t::VOLTAGE ? ramp_.value : config_.dyno.max_V;
  next_.set_A = mode_ == dyno_cmd_t::VOLTAGE ? config_.dyno.max_A : ramp_.value;
  if (mode_ == dyno_cmd_t::SHAFT_TORQUE) next_.set_A = follow_torque(dt_s);
}

double DynoCore::follow_torque(double dt_s) {
  wanted_A_ = field_A_for_load(config_.generator, speed_.rpm(), ramp_.value, most_A());
  const double slack = std::max(kFollowFraction * wanted_A_, config_.resolution_A);
  if (std::abs(wanted_A_ - field_A_.value) > slack) field_A_.advance(wanted_A_, dt_s);
  return field_A_.value;
}

// Rig time since the last step; host time before the first sample. Zero where one clock takes over from
// another.
double DynoCore::passed_s(Moment now) {
  const Clock clock{speed_.seen(), speed_.boot_id()};
  const std::int64_t time_us = clock.rig ? speed_.utime() : now.steady_us;
  const std::int64_t passed_us = clock == clock_ ? time_us - clock_us_ : 0;
  clock_ = clock;
  clock_us_ = time_us;
  return 1e-6 * static_cast<double>(std::max<std::int64_t>(passed_us, 0));
}

SupplyOrder DynoCore::step(Moment now) {
  look_for_trips(now);
  const double dt_s = passed_s(now);
  if (on_) follow_target(dt_s);
  next_.number = order_.number;
  if (next_ != order_) {
    ++next_.number;
    order_ = next_;
  }
  return order_;
}

bool DynoCore::at_target() const {
  if (supply_.link != SupplyLink::kUp || !supply_.as_written) return false;
  if (!on_ || mode_ != dyno_cmd_t::SHAFT_TORQUE)
    return ramp_.value == target_ && supply_.order_number == order_.number;
  // The current moves with the speed: what counts is the torque that the supply's set-point gives.
  const double given_Nm = shaft_torque_Nm(config_.generator, rad_s_of_rpm(speed_.rpm()), supply_.held_A);
  const double slack_Nm =
      kTorqueTolerance * target_ +
      shaft_torque_Nm(config_.generator, rad_s_of_rpm(speed_.rpm()), config_.resolution_A);
  return ramp_.value == target_ && supply_.order_number >= on_order_ &&
         std::abs(given_Nm - target_) <= slack_Nm;
}

std::int32_t DynoCore::run_state() const {
  if (trip_ != Trip::kNone) return dyno_status_t::TRIPPED;
  if (on_) return dyno_status_t::ON;
  return dyno_status_t::OFF;
}

dyno_status_t DynoCore::status(Moment now) const {
  dyno_status_t status = {};
  status.utime = speed_.utime();
  status.dyno_status_v1 = 1;
  status.host_utime = now.wall_us;
  status.link_state = static_cast<std::int32_t>(supply_.link);
  status.run_state = run_state();
  status.trip = static_cast<std::int32_t>(trip_);
  status.mode = mode_;
  status.target = target_;
  status.setpoint_V = supply_.held_V;
  status.setpoint_A = supply_.held_A;
  status.readback_V = supply_.out_V;
  status.readback_A = supply_.out_A;
  status.output_on = supply_.output_on ? 1 : 0;
  status.at_target = at_target() ? 1 : 0;
  status.read_errors = supply_.read_errors;
  status.reconnects = supply_.reconnects;
  status.last_cmd_epoch = last_epoch_;
  status.last_cmd_seq = last_seq_;
  status.last_cmd_result = static_cast<std::int32_t>(last_result_);
  return status;
}

imrig_msg::lease_t DynoCore::lease(Moment now) const {
  imrig_msg::lease_t lease = lease_.status(now);
  lease.utime = speed_.utime();
  return lease;
}

std::int32_t DynoCore::heartbeat_state() const {
  if (trip_ != Trip::kNone) return heartbeat_t::TRIPPED;
  const bool supply_there = supply_.link == SupplyLink::kUp && !supply_.wrong_device;
  if (supply_there) return heartbeat_t::OK;
  return heartbeat_t::DEGRADED;
}

}  // namespace imrig
