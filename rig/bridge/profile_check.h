#pragma once
// An UPLOAD command as a profile for the device, or why not. The device checks again, by itself; this check
// keeps nonsense and profiles over the rig's limits off the wire.

#include <imrig_msg/bridge_cmd_t.hpp>

#include "rig/base/rig_config.h"
#include "rig/link/host.h"
#include "rig/safety/command_result.h"

namespace imrig {

struct CheckedProfile {
  CommandResult result = CommandResult::kMalformed;
  LinkProfile profile;  // valid when the result is kDone
};

// kMalformed: a number out of range or no number. kOverLimit: a voltage segment over limits.voltage_V, a
// current segment whose offset and tones can add up to more than limits.current_A, a DC level over either.
CheckedProfile check_profile(const imrig_msg::bridge_cmd_t& cmd, const LimitsConfig& limits);

}  // namespace imrig
