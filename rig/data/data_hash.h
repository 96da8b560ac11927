#pragma once
// One number that tells data sets apart: over values, identifiers and what they mean, not over warnings,
// notes or the way they came.

#include <cstdint>

#include "rig/data/record.h"

namespace imrig {

// The same for a folder and for the log imported from it. Set DataSet::hash with it.
std::uint64_t hash_of(const DataSet& data);

}  // namespace imrig
