#pragma once
// A campaign's folder as one data set: DIR/log-000.lcm and, after each resume, one part more. A record that
// is whole in several parts counts once, as the last one has it.

#include <string>

#include "rig/data/record.h"

namespace imrig {

bool is_campaign_folder(const std::string& path);  // holds log-000.lcm

// Parts without a whole record (killed early) are told in the notes. Throws Error when no part holds one.
DataSet read_campaign_folder(const std::string& path);

}  // namespace imrig
