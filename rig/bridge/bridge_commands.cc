// Commands of the lease holder, from the guard to the device and back. One command at a time waits for the
// device; STOP overtakes it.

#include "rig/bridge/bridge_core.h"
#include "rig/bridge/profile_check.h"
#include "rig/link/device/result.h"

namespace imrig {

using imrig_msg::bridge_cmd_t;

namespace {

CommandResult result_of_link(std::int32_t result) {
  if (result == IMRIG_DONE) return CommandResult::kDone;
  if (result < 0) return CommandResult::kLinkAbsent;
  return static_cast<CommandResult>(static_cast<std::int32_t>(CommandResult::kDeviceBase) + result);
}

}  // namespace

void BridgeCore::on_bridge_cmd(const bridge_cmd_t& cmd, Moment now) {
  watch_lease(now);
  const CommandStamp stamp = stamp_of(cmd);
  const bool waiting = pending_.has_value();
  CommandResult result = guard_.check(stamp, lease_.epoch(), now);
  const bool passed = result == CommandResult::kDone;
  if (passed) result = carry_out(cmd, now);
  const LastCommand answer = {stamp.epoch, stamp.seq, result};
  const bool refused_beside = !passed || result == CommandResult::kBusy;
  if (result == CommandResult::kNoLease || result == CommandResult::kNotNew || (waiting && refused_beside)) {
    publish_status(now, answer);  // told once; the answer that the holder waits for stays
    return;
  }
  last_ = answer;
  settle_pending();
  publish_if_changed(now);
}

CommandResult BridgeCore::carry_out(const bridge_cmd_t& cmd, Moment now) {
  if (cmd.bridge_cmd_v1 != 1) return CommandResult::kMalformed;
  if (shut_down_us_) return CommandResult::kBusy;
  if (drive_.state() == StopState::kTripped && cmd.action != bridge_cmd_t::RESET)
    return CommandResult::kTripped;
  if (drive_.state() != StopState::kTripped && cmd.action == bridge_cmd_t::RESET) return CommandResult::kDone;
  if (!link_.up()) return CommandResult::kLinkAbsent;
  if (pending_ && cmd.action != bridge_cmd_t::STOP) return CommandResult::kBusy;
  switch (cmd.action) {
    case bridge_cmd_t::UPLOAD:
      return upload(cmd);
    case bridge_cmd_t::START:
      return start(cmd, now);
    case bridge_cmd_t::STOP:
      return stop(cmd);
    case bridge_cmd_t::RESET:
      return reset(cmd, now);
    default:
      return CommandResult::kMalformed;
  }
}

CommandResult BridgeCore::upload(const bridge_cmd_t& cmd) {
  const CheckedProfile checked =
      check_profile(cmd, config_.limits, static_cast<double>(link_.welcome()->sample_time_ns) * 1e-9);
  if (checked.result != CommandResult::kDone) return checked.result;
  loaded_ = 0;
  return pend(link_.upload(checked.profile), cmd);
}

CommandResult BridgeCore::start(const bridge_cmd_t& cmd, Moment now) {
  if (cmd.profile_id < 1) return CommandResult::kMalformed;
  if (cmd.profile_id != loaded_) return CommandResult::kDeviceNoProfile;
  if (const Trip trip = dyno_.check(now, true); trip != Trip::kNone) {
    drive_.trip(trip);
    return CommandResult::kTripped;
  }
  if (drive_.state() == StopState::kIdle) lost_before_ = link_.lost_blocks();
  const std::int64_t request = drive_.start(cmd.profile_id);
  return request == 0 ? CommandResult::kBusy : pend(request, cmd);
}

CommandResult BridgeCore::stop(const bridge_cmd_t& cmd) {
  const std::int64_t request = drive_.stop();
  if (request != 0) return pend(request, cmd);
  pending_.reset();
  return CommandResult::kDone;  // idle, or stopping already
}

CommandResult BridgeCore::reset(const bridge_cmd_t& cmd, Moment now) {
  if (extremes_.trip != Trip::kNone) return CommandResult::kCauseRemains;
  dyno_.forget_if_silent(now);
  lost_before_ = link_.lost_blocks();
  return pend(drive_.clear(), cmd);
}

CommandResult BridgeCore::pend(std::int64_t request, const bridge_cmd_t& cmd) {
  pending_ = Pending{request, cmd.action, cmd.profile_id};
  return CommandResult::kPending;
}

void BridgeCore::answer_pending(const LinkAnswer& answer) {
  if (!pending_ || pending_->request != answer.request) return;
  last_.result = result_of_link(answer.result);
  if (last_.result == CommandResult::kDone) {
    if (pending_->action == bridge_cmd_t::UPLOAD) loaded_ = pending_->profile_id;
    if (pending_->action == bridge_cmd_t::START) loaded_ = 0;
  }
  pending_.reset();
}

// A trip takes the command that was waiting along: whatever the device answers, it has not been carried out.
void BridgeCore::settle_pending() {
  if (!pending_ || drive_.state() != StopState::kTripped || drive_.clearing()) return;
  last_.result = CommandResult::kTripped;
  pending_.reset();
}

}  // namespace imrig
