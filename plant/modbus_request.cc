#include "plant/modbus_request.h"

namespace imrig::plant {

namespace {

constexpr std::uint8_t kReadHolding = 3;
constexpr std::uint8_t kWriteSingle = 6;
constexpr std::uint8_t kWriteMultiple = 16;
constexpr int kMaxRead = 125;
constexpr int kMaxWrite = 123;

ModbusRequest refused(ModbusException exception) {
  ModbusRequest request;
  request.exception = exception;
  return request;
}

std::uint16_t word(std::span<const std::uint8_t> pdu, std::size_t at) {
  return static_cast<std::uint16_t>((pdu[at] << 8) | pdu[at + 1]);
}

ModbusRequest read_multiple_write(std::span<const std::uint8_t> pdu) {
  if (pdu.size() < 6) return refused(ModbusException::kIllegalValue);
  ModbusRequest request;
  request.writes = true;
  request.address = word(pdu, 1);
  request.count = word(pdu, 3);
  const auto bytes = 2 * static_cast<std::size_t>(request.count);
  if (request.count < 1 || request.count > kMaxWrite || pdu[5] != bytes || pdu.size() != 6 + bytes) {
    return refused(ModbusException::kIllegalValue);
  }
  for (std::size_t i = 0; i < bytes / 2; ++i) request.values[i] = word(pdu, 6 + 2 * i);
  return request;
}

}  // namespace

ModbusRequest read_request(std::span<const std::uint8_t> pdu) {
  if (pdu.empty()) return refused(ModbusException::kIllegalFunction);
  const std::uint8_t function = pdu[0];
  if (function == kWriteMultiple) return read_multiple_write(pdu);
  if (function != kReadHolding && function != kWriteSingle) return refused(ModbusException::kIllegalFunction);
  if (pdu.size() != 5) return refused(ModbusException::kIllegalValue);
  ModbusRequest request;
  request.address = word(pdu, 1);
  request.writes = function == kWriteSingle;
  request.count = request.writes ? 1 : word(pdu, 3);
  if (request.writes) request.values[0] = word(pdu, 3);
  if (request.count < 1 || request.count > kMaxRead) return refused(ModbusException::kIllegalValue);
  return request;
}

}  // namespace imrig::plant
