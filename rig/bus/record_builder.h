#pragma once
// One record's messages to a Record in SI units, or the reason why it cannot be used.

#include <cstdint>
#include <optional>
#include <string>

#include "rig/bus/record_collector.h"
#include "rig/data/record.h"

namespace imrig {

struct BuiltRecord {
  std::optional<Record> record;
  std::string reason;         // why there is none
  bool from_samples = false;  // counts of a campaign, not an imported series
  // Of a campaign record's counts and facts; does not depend on the zeros, nor on when it was taken.
  std::uint64_t raw_hash = 0;
};

// Releases the raw blocks of the record as it goes.
BuiltRecord build_record(RawRecord& raw, const SensorZero& zero);

}  // namespace imrig
