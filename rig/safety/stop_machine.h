#pragma once
// The stop sequence of the motor drive.
//
//   idle --start--> running --held--> holding --start--> running        held: the profile ended and keeps its
//   last vector running, holding --stop--> stopping                                  stop: ramp down, then
//   gates off running, holding, stopping --gates_off--> idle                       gates_off: the device says
//   so any --trip--> tripped --reset--> idle                                the first cause stays until the
//   reset
//
// Nothing leads out of tripped but a reset, and a reset only when the cause is gone and the gates are known
// to be off.

#include <cstdint>

#include "rig/safety/trip.h"

namespace imrig {

enum class StopState : std::int32_t {
  kIdle = 0,
  kRunning = 1,
  kHolding = 2,
  kStopping = 3,
  kTripped = 4
};  // as bridge_status_t

class StopMachine {
 public:
  StopState state() const { return state_; }
  Trip cause() const { return cause_; }
  // May the gates switch at all? False in idle and tripped: then the device must be told to open them if it
  // has not.
  bool may_drive() const;

  // Each returns whether the event means something in this state; if not, nothing changes.
  bool start();
  bool held();
  bool stop();
  bool gates_off();
  bool trip(Trip cause);  // kNone is no trip; a later cause does not replace the first
  bool reset(bool cause_gone, bool gates_are_off);

 private:
  StopState state_ = StopState::kIdle;
  Trip cause_ = Trip::kNone;
};

}  // namespace imrig
