#pragma once
// An UPLOAD command as a profile for the device, or why not. Checked with the device's own rules
// (rig/link/device/profile.h) but against the rig's configuration: a profile over its limits never reaches
// the wire, whatever limits the device believes in.

#include <imrig_msg/bridge_cmd_t.hpp>

#include "rig/base/rig_config.h"
#include "rig/link/host.h"
#include "rig/safety/command_result.h"

namespace imrig {

struct CheckedProfile {
  CommandResult result = CommandResult::kMalformed;
  LinkProfile profile;  // valid when the result is kDone
};

// sample_s: the device's sample time. kMalformed: a number out of range or no number. kOverLimit: a voltage
// above limits.voltage_V, a current reference that can exceed limits.current_A.
CheckedProfile check_profile(const imrig_msg::bridge_cmd_t& cmd, const LimitsConfig& limits, double sample_s);

}  // namespace imrig
