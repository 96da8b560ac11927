#pragma once
// What the TCP and the serial server share: the register file under its lock, and the answer to one whole
// request.

#include <modbus/modbus.h>

#include <memory>
#include <mutex>
#include <span>

#include "plant/modbus_registers.h"

namespace imrig::plant {

struct FreeModbus {
  void operator()(modbus_t* context) const { modbus_free(context); }
};
using ModbusContext = std::unique_ptr<modbus_t, FreeModbus>;

struct FreeMapping {
  void operator()(modbus_mapping_t* mapping) const { modbus_mapping_free(mapping); }
};

class ModbusFace {
 public:
  explicit ModbusFace(const RidenRatings& ratings);

  // request: the whole frame as libmodbus receives it; trailing: bytes of checksum behind the request. Sends
  // the reply to the context's socket; false when it could not be sent.
  bool answer(modbus_t* context, std::span<const std::uint8_t> request, std::size_t trailing);
  ExcitationCommand command() const;
  void set_readback(const ExcitationReadback& readback);

 private:
  mutable std::mutex mutex_;
  RidenRegisters registers_;  // under mutex_
  std::unique_ptr<modbus_mapping_t, FreeMapping>
      mapping_;  // the server thread's copy, for libmodbus to read from
};

// A server's body: serves until destroyed.
class ModbusWire {
 public:
  virtual ~ModbusWire() = default;
  virtual std::string bound_url() const = 0;
};

// Throw Error: port in use, address that is none of this machine, missing device file.
std::unique_ptr<ModbusWire> serve_tcp(const std::string& host, int port, ModbusFace& face);
std::unique_ptr<ModbusWire> serve_rtu(const std::string& url, const std::string& device, int baud, int unit,
                                      ModbusFace& face);

}  // namespace imrig::plant
