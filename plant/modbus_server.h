#pragma once
// The excitation supply's Modbus face: a bench supply of the Riden RD6006 kind, served by libmodbus over TCP
// or a serial line, in its own thread. Holding registers (function 3 reads, 6 and 16 write; anything else is
// an illegal function):
//   0 identity, 3 firmware, 8 V set (x 0.01 V), 9 I set (x 0.001 A), 10 V out, 11 I out, 12-13 power (32
//   bits, x 0.01 W, high word first), 15 lock, 16 protection (1 OVP, 2 OCP), 17 CV/CC (1 CC), 18 output on,
//   82/83 OVP/OCP levels (x 0.01 V, x 0.001 A).
// A write outside a register's range gets exception 3, a write to a register that cannot be written exception
// 2, and then nothing of it is taken. Every value has the resolution of its register. When protection trips
// the output goes off; the cause stays in register 16 until the output is switched on again.

#include <cstdint>
#include <memory>
#include <string>

#include "plant/excitation.h"

namespace imrig::plant {

struct RidenRatings {
  std::uint16_t identity = 60062;  // what register 0 of an RD6006 says
  std::uint16_t firmware = 128;    // 1.28
  double max_V = 60.0;             // largest set-points
  double max_A = 6.0;
  double max_ovp_V = 62.0;  // largest protection levels, and the levels at the start
  double max_ocp_A = 6.2;
};

class ModbusServer {
 public:
  // url: "tcp://127.0.0.1:PORT" (0: any free port) or "rtu:///dev/pts/N?baud=115200&unit=1". Serves when the
  // constructor returns. Throws Error: malformed URL, port in use, missing or unusable device file.
  ModbusServer(const std::string& url, const RidenRatings& ratings = {});
  ~ModbusServer();
  ModbusServer(const ModbusServer&) = delete;
  ModbusServer& operator=(const ModbusServer&) = delete;

  std::string bound_url() const;  // with the port that was bound
  // Both may be called from any thread, at any rate.
  ExcitationCommand command() const;
  void set_readback(const ExcitationReadback& readback);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace imrig::plant
