#pragma once
// One Modbus connection through libmodbus, TCP or RTU, without its error recovery: that one puts replies out
// of step, or hangs. What fails stays failed until close() and connect(). Holding registers only.

#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace imrig {

// kRefused: the device answered with an exception; the line itself is in order. kLost: time-out, garbage,
// closed.
enum class WireResult { kDone, kRefused, kLost };

class ModbusWire {
 public:
  // url: "tcp://HOST:PORT?unit=N" or "rtu:///DEVICE?baud=115200&unit=1". response_ms is both of libmodbus'
  // time-outs: to the reply's first byte, and between its bytes. Throws Error: malformed URL, missing device
  // file.
  ModbusWire(const std::string& url, int response_ms);
  ~ModbusWire();

  bool connect();
  void close();
  // Up to 125 and 123 registers. What is still in the line from an earlier request is thrown away first.
  WireResult read(int address, std::span<std::uint16_t> words);
  WireResult write(int address, std::span<const std::uint16_t> words);
  std::string last_error() const { return error_; }

 private:
  struct Context;
  WireResult told(int done, std::size_t wanted);

  std::unique_ptr<Context> context_;
  std::string error_;
};

}  // namespace imrig
