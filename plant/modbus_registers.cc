#include "plant/modbus_registers.h"

#include <algorithm>
#include <cmath>

namespace imrig::plant {

namespace {

enum Register : int {
  kIdentity = 0,
  kFirmware = 3,
  kSetV = 8,
  kSetA = 9,
  kOutV = 10,
  kOutA = 11,
  kPowerHigh = 12,
  kPowerLow = 13,
  kLock = 15,
  kProtection = 16,
  kConstantCurrent = 17,
  kOutputOn = 18,
  kOvp = 82,
  kOcp = 83,
};

constexpr double kPerV = 100.0;
constexpr double kPerA = 1000.0;
constexpr double kPerW = 100.0;

std::uint16_t counts(double value, double per_unit) {
  if (!(value > 0.0)) return 0;  // and not a number
  return static_cast<std::uint16_t>(std::min(std::round(value * per_unit), 65535.0));
}

}  // namespace

RidenRegisters::RidenRegisters(const RidenRatings& ratings) {
  const auto writable = [this](int address, std::uint16_t high) {
    writable_[static_cast<std::size_t>(address)] = true;
    high_[static_cast<std::size_t>(address)] = high;
  };
  writable(kSetV, counts(ratings.max_V, kPerV));
  writable(kSetA, counts(ratings.max_A, kPerA));
  writable(kLock, 1);
  writable(kOutputOn, 1);
  writable(kOvp, counts(ratings.max_ovp_V, kPerV));
  writable(kOcp, counts(ratings.max_ocp_A, kPerA));
  words_[kIdentity] = ratings.identity;
  words_[kFirmware] = ratings.firmware;
  words_[kOvp] = high_[kOvp];
  words_[kOcp] = high_[kOcp];
}

ModbusException RidenRegisters::check_write(int address, std::uint16_t value) const {
  const auto at = static_cast<std::size_t>(address);
  if (!writable_[at]) return ModbusException::kIllegalAddress;
  return value > high_[at] ? ModbusException::kIllegalValue : ModbusException::kNone;
}

void RidenRegisters::write(int address, std::uint16_t value) {
  if (address == kOutputOn && value == 1) words_[kProtection] = 0;
  words_[static_cast<std::size_t>(address)] = value;
}

ModbusException RidenRegisters::carry_out(const ModbusRequest& request) {
  if (request.exception != ModbusException::kNone) return request.exception;
  if (request.address + request.count > kCount) return ModbusException::kIllegalAddress;
  if (!request.writes) return ModbusException::kNone;
  for (int i = 0; i < request.count; ++i) {
    const ModbusException no = check_write(request.address + i, request.values[static_cast<std::size_t>(i)]);
    if (no != ModbusException::kNone) return no;
  }
  for (int i = 0; i < request.count; ++i)
    write(request.address + i, request.values[static_cast<std::size_t>(i)]);
  return ModbusException::kNone;
}

void RidenRegisters::set_readback(const ExcitationReadback& readback) {
  words_[kOutV] = counts(readback.V, kPerV);
  words_[kOutA] = counts(readback.A, kPerA);
  const double power = std::clamp(std::round(readback.V * readback.A * kPerW), 0.0, 4294967295.0);
  const std::uint32_t watts = std::isfinite(power) ? static_cast<std::uint32_t>(power) : 0;
  words_[kPowerHigh] = static_cast<std::uint16_t>(watts >> 16);
  words_[kPowerLow] = static_cast<std::uint16_t>(watts & 0xFFFF);
  words_[kConstantCurrent] = readback.constant_current ? 1 : 0;
  const bool tripped = readback.tripped_ovp || readback.tripped_ocp;
  if (tripped && !tripped_) {
    words_[kProtection] = readback.tripped_ovp ? 1 : 2;
    words_[kOutputOn] = 0;
  }
  tripped_ = tripped;
}

ExcitationCommand RidenRegisters::command() const {
  ExcitationCommand command;
  command.set_V = words_[kSetV] / kPerV;
  command.set_A = words_[kSetA] / kPerA;
  // The output rearms by being off: a client that is quicker than that waits for it.
  command.output_on = words_[kOutputOn] == 1 && !tripped_;
  command.ovp_V = words_[kOvp] / kPerV;
  command.ocp_A = words_[kOcp] / kPerA;
  return command;
}

}  // namespace imrig::plant
