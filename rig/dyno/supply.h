#pragma once
// What dyno core and Modbus client hand each other: the state the supply is to be in, and what is known about
// it.

#include <cstdint>
#include <limits>

namespace imrig {

struct SupplyOrder {
  double set_V = 0.0;
  double set_A = 0.0;
  bool output_on = false;
  std::int64_t number = 0;  // rises with every change

  bool operator==(const SupplyOrder&) const = default;
};

enum class SupplyLink : std::int32_t { kAbsent = 0, kUp = 1, kSilent = 2 };  // as dyno_status_t

struct SupplyReport {
  SupplyLink link = SupplyLink::kAbsent;  // kSilent: has answered before, does not now
  bool wrong_device = false;              // somebody answers, but with another identity
  bool as_written = false;                // every register that was written reads back as written
  bool mismatch = false;                  // it does not, twice in a row, or a write was refused
  std::int64_t order_number = 0;          // of the newest order that was written and polled after
  std::int64_t heard_steady_us = 0;       // last complete poll
  double held_V = 0.0;                    // set-points read back
  double held_A = 0.0;
  bool output_on = false;
  double out_V = std::numeric_limits<double>::quiet_NaN();  // NaN where the map has no such register
  double out_A = std::numeric_limits<double>::quiet_NaN();
  bool constant_current = false;
  std::int64_t protection = 0;
  std::int64_t read_errors = 0;
  std::int64_t reconnects = 0;  // connections after the first
};

}  // namespace imrig
