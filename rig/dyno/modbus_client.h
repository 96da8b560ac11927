#pragma once
// Keeps the supply in the ordered state over Modbus, in a thread of its own, so that no time-out ever delays
// a heartbeat.
//
// On any error: close, wait (0.2 s, doubling to 2 s), connect, verify the identity, arm the supply's own
// watchdog, read the set-points back. Writes on change only, and reads back what it wrote. Before the first
// order the supply is told to be off.

#include <cstdint>
#include <memory>
#include <string>

#include "rig/dyno/register_map.h"
#include "rig/dyno/supply.h"

namespace imrig {

struct ModbusClientConfig {
  std::string url;
  int response_ms = 300;
  int poll_ms = 20;
};

class ModbusClient {
 public:
  // Starts the thread; a supply that does not answer is a state, not an error. Throws Error: malformed URL,
  // missing device file.
  ModbusClient(const ModbusClientConfig& config, const RegisterMap& map);
  ~ModbusClient();  // may take two time-outs
  ModbusClient(const ModbusClient&) = delete;
  ModbusClient& operator=(const ModbusClient&) = delete;

  void order(const SupplyOrder& order);  // the newest counts
  SupplyReport report() const;           // heard_steady_us by monotonic_us
  std::string trouble() const;           // the last one, for the log; empty while all is well

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace imrig
