#pragma once
// What is said to a supply over one connection: identity, watchdog, set-points on change only, polls. No
// thread, no clock of its own.

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "rig/dyno/modbus_wire.h"
#include "rig/dyno/register_map.h"
#include "rig/dyno/supply.h"

namespace imrig {

enum class SessionResult { kDone, kLost, kWrongDevice };

class SupplySession {
 public:
  SupplySession(ModbusWire& wire, const RegisterMap& map);

  // After each connect: verifies the identity, arms the supply's own watchdog, reads everything back. What
  // the supply lost meanwhile counts as a mismatch, it is not silently switched on again. An identity is
  // believed wrong only when it is read wrong twice: on a serial line a late reply can pass for a fresh one.
  SessionResult begin();
  // Writes what differs from what the supply holds and reads it back, then polls. The report's fields that
  // come from the registers are set, and its order_number.
  SessionResult exchange(const SupplyOrder& order, std::int64_t now_us, SupplyReport& report);
  std::string trouble() const { return trouble_; }  // the last one

 private:
  using Words = std::vector<std::uint16_t>;
  struct Block {
    int address = 0;
    int count = 0;
  };

  void plan_blocks();
  void take_what_is_held();
  bool read_all();
  SessionResult check_identity();
  bool arm_watchdog();
  bool write_changes(const SupplyOrder& order);
  bool write_setpoints(const Words& volts, const Words& amps);
  bool write_one(Role role, const Words& words);
  bool write_at(int address, const Words& words);
  Words wanted(Role role, double value) const;
  bool differs(Role role, const Words& words) const;
  bool holds(Role role, const Words& words) const;
  void judge(std::int64_t now_us);
  void note_what_is_held();
  double value(Role role, double fallback) const;
  bool lost(const std::string& what);

  ModbusWire& wire_;
  const RegisterMap& map_;
  std::vector<Block> blocks_;          // what a poll reads
  std::map<int, std::uint16_t> held_;  // by address, as last read
  std::map<Role, Words> written_;      // what the supply should hold; first taken from it
  bool taken_ = true;                  // every write of this exchange was read back equal
  int unequal_polls_ = 0;
  std::int64_t rewritten_us_ = 0;
  std::string trouble_;
};

}  // namespace imrig
