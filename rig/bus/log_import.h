#pragma once
// A data set as an event log: DATASET, REMARKs, then per record RECORD begin, SERIES or POINTS, RECORD end.
// read_log gives it back to the bit.

#include <string>

#include "rig/data/record.h"

namespace imrig {

// Whole or absent: written beside the target and renamed over it. Event times are sample times from 0, so the
// same data gives the same bytes. Throws Error: cannot be written, or a record that cannot be told exactly
// (columns of different lengths, a text longer than 4 kB).
void write_log(const DataSet& data, const std::string& path);

}  // namespace imrig
