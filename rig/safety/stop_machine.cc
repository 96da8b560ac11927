#include "rig/safety/stop_machine.h"

namespace imrig {

bool StopMachine::may_drive() const { return state_ != StopState::kIdle && state_ != StopState::kTripped; }

bool StopMachine::start() {
  if (state_ != StopState::kIdle && state_ != StopState::kHolding) return false;
  state_ = StopState::kRunning;
  return true;
}

bool StopMachine::held() {
  if (state_ != StopState::kRunning) return false;
  state_ = StopState::kHolding;
  return true;
}

bool StopMachine::stop() {
  if (state_ != StopState::kRunning && state_ != StopState::kHolding) return false;
  state_ = StopState::kStopping;
  return true;
}

bool StopMachine::gates_off() {
  if (!may_drive()) return false;
  state_ = StopState::kIdle;
  return true;
}

bool StopMachine::trip(Trip cause) {
  if (cause == Trip::kNone || state_ == StopState::kTripped) return false;
  state_ = StopState::kTripped;
  cause_ = cause;
  return true;
}

bool StopMachine::reset(bool cause_gone, bool gates_are_off) {
  if (state_ != StopState::kTripped || !cause_gone || !gates_are_off) return false;
  state_ = StopState::kIdle;
  cause_ = Trip::kNone;
  return true;
}

}  // namespace imrig
