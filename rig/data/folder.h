#pragma once
// A data set as a folder: dataset.toml and the CSV or .mat files it names (docs/data-sets.md).

#include <string>

#include "rig/data/record.h"

namespace imrig {

// Reads, converts to star-equivalent SI values, checks quality and fills each record's warnings. A record
// whose file is sound but which cannot be used (no stretch of uniform sampling, fewer than 16 samples) is
// left out with its reason in the set's notes. Throws Error: no such folder, manifest or file; unknown key;
// wrong type; missing column; text in a number; no usable record at all.
DataSet read_folder(const std::string& folder);

// Writes a folder that read_folder turns into the same bits (but for warnings, which are found again). The
// folder must not exist or be empty; it appears whole or not at all. Throws Error.
void write_folder(const DataSet& data, const std::string& folder);

}  // namespace imrig
