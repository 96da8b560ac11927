#pragma once
// What became of a command; travels as last_cmd_result. 1..99 are ours, 100..199 the device's (100 + rig/link/device/result.h).

#include <cstdint>
#include <string_view>

namespace imrig {

enum class CommandResult : std::int32_t {
  kDone = 0,
  kPending = 1,       // taken, the device has not answered yet
  kNoLease = 2,       // epoch is not that of the current grant
  kNotNew = 3,        // sequence not above the last one of this epoch
  kStale = 4,         // older than its time-to-live, or from the future
  kTripped = 5,       // only RESET is taken now
  kMalformed = 6,     // action, mode or a number out of range
  kLinkAbsent = 7,    // no device, or no supply
  kBusy = 8,          // another command is being carried out
  kOverLimit = 9,     // asks for more than the configuration allows
  kCauseRemains = 10, // RESET: what tripped the rig is still there
  kDeviceBase = 100,  // + the device's result
  kDeviceMalformed = 101,
  kDeviceNoProfile = 102,
  kDeviceIncomplete = 103,
  kDeviceBusy = 104,
  kDeviceTripped = 105,
  kDeviceOverLimit = 106,
  kDeviceOvertaken = 107,
  kDeviceNoSession = 108,
};

constexpr std::string_view result_name(CommandResult result) {
  switch (result) {
    case CommandResult::kDone: return "done";
    case CommandResult::kPending: return "pending";
    case CommandResult::kNoLease: return "not the lease holder";
    case CommandResult::kNotNew: return "sequence already used";
    case CommandResult::kStale: return "too old";
    case CommandResult::kTripped: return "tripped, reset first";
    case CommandResult::kMalformed: return "malformed";
    case CommandResult::kLinkAbsent: return "device absent";
    case CommandResult::kBusy: return "busy";
    case CommandResult::kOverLimit: return "over a limit";
    case CommandResult::kCauseRemains: return "the cause of the trip is still there";
    case CommandResult::kDeviceBase: return "refused by the device";
    case CommandResult::kDeviceMalformed: return "device: malformed";
    case CommandResult::kDeviceNoProfile: return "device: no such profile loaded";
    case CommandResult::kDeviceIncomplete: return "device: profile incomplete";
    case CommandResult::kDeviceBusy: return "device: busy";
    case CommandResult::kDeviceTripped: return "device: tripped";
    case CommandResult::kDeviceOverLimit: return "device: over a limit";
    case CommandResult::kDeviceOvertaken: return "device: overtaken by a later order";
    case CommandResult::kDeviceNoSession: return "device: no session";
  }
  return "refused by the device";
}

}  // namespace imrig
