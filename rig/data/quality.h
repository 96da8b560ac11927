#pragma once
// What is likely to be wrong with measured data, each as one sentence with numbers. Nothing is repaired here,
// nothing refused.
//   missing values; constant and clipped channels (flat at an extreme); phases in reversed order (voltage,
//   current and speed turn in different ways); units (mA, kV, rad/s as rpm) by values no motor of this kind
//   has; speed that contradicts frequency and pole pairs.

#include <string>
#include <vector>

#include "rig/data/record.h"

namespace imrig {

// Sentences about one record; empty if nothing was found. pole_pairs 0 leaves out what needs them.
std::vector<std::string> quality_of(const Record& record, int pole_pairs);

// Adds to each record's warnings what quality_of finds and is not there yet.
void add_quality_warnings(DataSet& data);

}  // namespace imrig
