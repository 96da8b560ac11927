#pragma once
// Why a rig stopped. Trips are states of running processes, never exceptions; the first cause stays until an explicit reset.
// 1..99 are ours, 100..199 come from the device (rig/link/device/result.h), 200..299 from the excitation supply.

#include <cstdint>
#include <string_view>

namespace imrig {

enum class Trip : std::int32_t {
  kNone = 0,
  kOperatorStop = 1,        // emergency stop command
  kOverCurrent = 2,         // |stator current vector| above the limit
  kOverSpeed = 3,
  kOverTemperature = 4,
  kLinkSilent = 5,          // no valid frame from the DSP within the limit
  kLeaseLost = 6,           // the holder of the lease stopped renewing while the rig was running
  kPeerTripped = 7,         // bridge or dyno stops because the other one did
  kPeerSilent = 8,          // no heartbeat from the other actuator's process
  kSamplesLost = 9,         // more blocks lost than the configuration allows
  kDeviceRebooted = 10,     // the DSP started anew while it should have been driving
  kStopTooLong = 11,        // told to ramp down, the DSP did not come to rest in time
  kDeviceBase = 100,        // + device trip
  kDeviceOverCurrent = 101,
  kDeviceOverSpeed = 102,
  kDeviceOverTemperature = 103,
  kDeviceWatchdog = 104,    // the device heard nothing from the bridge
  kDeviceOrdered = 105,
  kSupplySilent = 201,      // excitation supply does not answer
  kSupplyProtection = 202,  // its own over-voltage or over-current protection
  kSupplyMismatch = 203,    // registers do not read back as written, or another device answers
};

constexpr std::string_view trip_name(Trip trip) {
  switch (trip) {
    case Trip::kNone: return "none";
    case Trip::kOperatorStop: return "emergency stop";
    case Trip::kOverCurrent: return "over-current";
    case Trip::kOverSpeed: return "over-speed";
    case Trip::kOverTemperature: return "stator over-temperature";
    case Trip::kLinkSilent: return "DSP link silent";
    case Trip::kLeaseLost: return "command lease lost";
    case Trip::kPeerTripped: return "peer tripped";
    case Trip::kPeerSilent: return "peer silent";
    case Trip::kSamplesLost: return "samples lost";
    case Trip::kDeviceRebooted: return "DSP rebooted";
    case Trip::kStopTooLong: return "stop took too long";
    case Trip::kDeviceBase: return "device trip";
    case Trip::kDeviceOverCurrent: return "device: over-current";
    case Trip::kDeviceOverSpeed: return "device: over-speed";
    case Trip::kDeviceOverTemperature: return "device: stator over-temperature";
    case Trip::kDeviceWatchdog: return "device: host silent";
    case Trip::kDeviceOrdered: return "device: trip ordered";
    case Trip::kSupplySilent: return "excitation supply silent";
    case Trip::kSupplyProtection: return "excitation supply protection";
    case Trip::kSupplyMismatch: return "excitation supply mismatch";
  }
  return "unknown trip";
}

}  // namespace imrig
