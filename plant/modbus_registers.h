#pragma once
// Register file of the emulated bench supply (layout in modbus_server.h). No I/O, no thread.

#include <array>
#include <cstdint>
#include <span>

#include "plant/excitation.h"
#include "plant/modbus_request.h"
#include "plant/modbus_server.h"

namespace imrig::plant {

class RidenRegisters {
 public:
  static constexpr int kCount = 100;

  explicit RidenRegisters(const RidenRatings& ratings);

  // Carries a checked request out, or says why not; a refused write changes nothing.
  ModbusException carry_out(const ModbusRequest& request);
  void set_readback(const ExcitationReadback& readback);
  ExcitationCommand command() const;
  const std::array<std::uint16_t, kCount>& words() const { return words_; }

 private:
  ModbusException check_write(int address, std::uint16_t value) const;
  void write(int address, std::uint16_t value);

  std::array<std::uint16_t, kCount> words_{};
  std::array<std::uint16_t, kCount> high_{};  // largest value that may be written
  std::array<bool, kCount> writable_{};
  bool tripped_ = false;  // as last read back: only a new trip switches off
};

}  // namespace imrig::plant
