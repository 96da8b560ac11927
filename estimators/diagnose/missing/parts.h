#pragma once
// A few long records as many short ones. One log of a drive that runs freely, or a handful of starts, hold
// many operating points but few records, and what is judged record by record (records left out, intervals,
// values a record) has nothing to go by; the same with one long start among many short records. Each part has
// its own initial flux, like a record.

#include <string>
#include <vector>

#include "rig/data/record.h"

namespace imrig::est {

inline constexpr std::size_t kFewRecords = 12;  // time series, below which long ones are cut

// The data set with long time series cut into equal parts, none shorter than 0.2 s or 400 samples: few
// records into about sixteen parts in all, of many records those of three times the usual length or more.
// cut: the records that were.
DataSet in_parts(const DataSet& data, std::vector<std::string>& cut);

}  // namespace imrig::est
