#pragma once
// What became of a campaign's points, and the sentence that says so.

#include <fmt/format.h>

#include <string>
#include <vector>

namespace imrig {

struct Tally {
  int total = 0;
  int done = 0;     // earlier runs included
  int failed = 0;   // of which ...
  int stalled = 0;  // ... the motor could not carry
  int tripped = 0;  // ... tripped the device
  int failed_in_row = 0;

  void point_failed(bool by_stall, bool by_trip) {
    ++failed;
    if (by_stall) ++stalled;
    if (by_trip) ++tripped;
    if (!by_stall && !by_trip) ++failed_in_row;  // a corner of the grid may stall point after point
  }

  // Empty when every point was taken.
  std::string sentence() const {
    if (failed == 0) return "";
    std::vector<std::string> kinds;
    if (stalled > 0) kinds.push_back(fmt::format("{} because the motor stalled", stalled));
    if (tripped > 0) kinds.push_back(fmt::format("{} because the device tripped", tripped));
    if (const int other = failed - stalled - tripped; other > 0 && other < failed)
      kinds.push_back(fmt::format("{} for other reasons", other));
    return fmt::format("{} of {} points could not be taken{}{}", failed, total, kinds.empty() ? "" : ": ",
                       fmt::join(kinds, ", "));
  }
};

}  // namespace imrig
