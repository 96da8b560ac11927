#pragma once
// Register map of an excitation supply, as data: models/registers/NAME.toml (docs/dyno.md lists the keys).
// Holding registers with zero-based addresses as they stand on the wire. physical value = scale * raw.

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "rig/dyno/word_order.h"

namespace imrig {

// What a register is for. A supply that takes set-points has set_V or set_A, and output.
enum class Role {
  kIdentity,
  kSetV,
  kSetA,
  kOutV,
  kOutA,
  kOutput,           // 1 on, 0 off
  kProtection,       // not 0: the supply's own protection has tripped, or it reports an error
  kConstantCurrent,  // not 0: the current set-point limits
  kWatchdogEnable,   // both written at every connect
  kWatchdogSeconds,
};

enum class RegisterKind { kU16, kS16, kU32, kS32, kF32 };

struct Register {
  int address = 0;
  RegisterKind kind = RegisterKind::kU16;
  WordOrder order = WordOrder::kABCD;
  double scale = 1.0;
  std::string unit;
  bool read_only = false;

  int words() const;  // 1 or 2
  // Nearest raw value, held to what the kind can carry.
  std::vector<std::uint16_t> encode(double value) const;
  double decode(const std::uint16_t* words) const;
  // Largest difference between a value and what the register makes of it.
  double resolution(double value) const;
};

struct RegisterMap {
  std::string name;
  std::map<Role, Register> registers;
  std::vector<long long> identities;  // raw values that are this supply; empty: it cannot be told
  double watchdog_s = 0.0;            // armed at every connect; 0: the supply has none

  const Register* find(Role role) const;
  bool takes_setpoints() const { return find(Role::kOutput) != nullptr; }
};

// name: a file in models/registers without its ending, or a path. Throws Error: no such map, unknown key,
// role, kind or unit, addresses that overlap, a supply that can be switched on but not set.
RegisterMap load_register_map(const std::string& name);
RegisterMap parse_register_map(const std::string& text, const std::string& where);

}  // namespace imrig
