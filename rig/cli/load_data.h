#pragma once
// Measurements as a user names them on the command line.

#include <string>
#include <vector>

#include "rig/data/record.h"

namespace imrig {

// Each path is a data-set folder or an event log; several are merged into one set. Record ids that occur
// twice get their set's name in front. Throws Error: nothing there, pole pairs or connection differ, no
// record at all.
DataSet load_data(const std::vector<std::string>& paths);

}  // namespace imrig
