#pragma once
// A Modbus request's protocol data unit, read with every length checked before it is used (Modbus application
// protocol 1.1b3, sections 6.3, 6.6, 6.12). libmodbus trusts a request's own byte counts; nothing is handed
// to it that has not passed here.

#include <array>
#include <cstdint>
#include <span>

namespace imrig::plant {

// Exception codes of the application protocol, section 7.
enum class ModbusException : std::uint8_t {
  kNone = 0,
  kIllegalFunction = 1,
  kIllegalAddress = 2,
  kIllegalValue = 3
};

struct ModbusRequest {
  ModbusException exception = ModbusException::kNone;
  bool writes = false;
  int address = 0;
  int count = 0;                            // registers
  std::array<std::uint16_t, 123> values{};  // the first count of them, for a write
};

// pdu begins with the function code and holds exactly one request; unit and checksum are not part of it.
ModbusRequest read_request(std::span<const std::uint8_t> pdu);

}  // namespace imrig::plant
