#pragma once
// Which records of a campaign's log parts are whole: RECORD END complete, and as many samples before it as it
// names. What --resume compares the journal with. A torn tail (a crash) is no fault; a part that holds no
// event at all is passed over.

#include <string>
#include <vector>

#include "rig/campaign/journal.h"

namespace imrig {

struct LogScan {
  std::vector<DonePoint> whole;  // the last whole record of each id
  int highest_number = 0;        // of any record ever begun
};

LogScan scan_log_parts(const std::string& folder, const std::string& prefix);

}  // namespace imrig
