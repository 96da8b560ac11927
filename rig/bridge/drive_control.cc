#include "rig/bridge/drive_control.h"

#include "rig/link/device/result.h"

namespace imrig {

namespace {

constexpr std::int64_t kSettling_us = 20'000;  // two periods of the device's status

bool drives(std::int32_t device_state) { return device_state != IMRIG_IDLE && device_state != IMRIG_TRIPPED; }

Trip trip_of_device(std::int32_t trip) {
  return static_cast<Trip>(static_cast<std::int32_t>(Trip::kDeviceBase) + trip);
}

}  // namespace

std::int64_t DriveControl::start(std::int32_t profile_id) {
  if (machine_.state() == StopState::kIdle) profile_id_ = 0;
  if (!machine_.start()) return 0;
  starting_id_ = profile_id;
  seen_driving_ = false;
  return start_request_ = link_.start(profile_id);
}

std::int64_t DriveControl::stop() {
  if (!machine_.stop()) return 0;
  return stop_request_ = link_.stop(kRamp_s);
}

void DriveControl::trip(Trip cause) {
  const bool first = machine_.trip(cause);
  const bool clearing = clear_request_ != 0;
  start_request_ = stop_request_ = clear_request_ = 0;
  if (first || clearing) {  // whatever the device said before, it has to hear and say it anew
    trip_request_ = 0;
    device_state_.reset();
  }
  insist_on_gates_off();
}

void DriveControl::insist_on_gates_off() {
  if (machine_.state() != StopState::kTripped || clear_request_ != 0 || trip_request_ != 0 || !link_.up())
    return;
  if (device_state_ != IMRIG_TRIPPED) trip_request_ = link_.trip();
}

std::int64_t DriveControl::clear() {
  if (machine_.state() != StopState::kTripped || clear_request_ != 0) return 0;
  trip_request_ = 0;  // a late answer to it says nothing about what comes after
  return clear_request_ = link_.clear();
}

bool DriveControl::gates_known_off() const { return link_.up() && device_state_ && !drives(*device_state_); }

void DriveControl::on_welcome(const LinkWelcome& welcome) {
  if (!welcome.new_boot) return;
  status_.reset();
  device_state_.reset();
  if (machine_.may_drive()) trip(Trip::kDeviceRebooted);
}

void DriveControl::on_down() {
  if (machine_.may_drive()) trip(Trip::kLinkSilent);
}

void DriveControl::on_status(const imrig_status& status) {
  const auto& welcome = link_.welcome();
  if (!welcome) return;
  if (status.boot_id != welcome->boot_id) {
    if (machine_.may_drive()) trip(Trip::kDeviceRebooted);
    return;
  }
  if (status_ && status.seq <= status_->seq) return;  // overtaken on the way
  status_ = status;
  device_state_ = status.state;
  follow(status);
}

void DriveControl::follow(const imrig_status& status) {
  if (machine_.state() == StopState::kTripped) return;
  if (status.state == IMRIG_TRIPPED) return trip(trip_of_device(status.trip));
  if (machine_.state() == StopState::kIdle) {
    if (drives(status.state)) trip(Trip::kLeaseLost);  // nobody of this bridge ordered it
    return;
  }
  if (start_request_ != 0 || stop_request_ != 0) return;
  const bool ours = status.profile_id == profile_id_;
  if (ours && (status.state == IMRIG_RUNNING || status.state == IMRIG_STOPPING)) seen_driving_ = true;
  if (!seen_driving_ && status.utime < settled_utime_) return;
  if (status.state == IMRIG_IDLE) machine_.gates_off();
  if (status.state == IMRIG_HOLDING && ours) machine_.held();
  if (status.state == IMRIG_STOPPING) machine_.stop();
}

void DriveControl::on_answer(const LinkAnswer& answer) {
  if (answer.request == 0) return;
  if (answer.request == trip_request_) {
    trip_request_ = 0;
    if (answer.result == IMRIG_DONE) device_state_ = IMRIG_TRIPPED;
  } else if (answer.request == start_request_) {
    start_answered(answer.result);
  } else if (answer.request == stop_request_) {
    stop_answered(answer.result);
  } else if (answer.request == clear_request_) {
    clear_answered(answer.result);
  }
}

void DriveControl::start_answered(std::int32_t result) {
  start_request_ = 0;
  if (result < 0) return trip(Trip::kLinkSilent);  // nobody knows whether it runs
  if (result == IMRIG_DONE) {
    profile_id_ = starting_id_;
    settled_utime_ = (status_ ? status_->utime : 0) + kSettling_us;
    return;
  }
  if (device_state_ == IMRIG_HOLDING) {
    machine_.held();
  } else {
    machine_.gates_off();
  }
}

void DriveControl::stop_answered(std::int32_t result) {
  stop_request_ = 0;
  if (result != IMRIG_DONE) return trip(result < 0 ? Trip::kLinkSilent : Trip::kStopTooLong);
  seen_driving_ = true;
}

void DriveControl::clear_answered(std::int32_t result) {
  clear_request_ = 0;
  if (result != IMRIG_DONE) return;
  machine_.reset(true, true);  // the device clears a trip with its gates off or not at all
  device_state_ = IMRIG_IDLE;
}

void DriveControl::poll(std::int64_t now_us) {
  if (machine_.state() != StopState::kStopping) {
    stop_us_ = -1;
  } else if (stop_us_ < 0) {
    stop_us_ = now_us;
  } else if (now_us - stop_us_ > kStopPatience_us) {
    trip(Trip::kStopTooLong);
  }
  insist_on_gates_off();
}

}  // namespace imrig
