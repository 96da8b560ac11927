#pragma once
// The largest magnitude of one channel over all points of a compared record, measured or predicted; 0 where
// it has none.

#include <cmath>
#include <string>

#include "estimators/diagnose/compare.h"

namespace imrig {

inline double channel_scale(const est::ComparedRecord& record, const std::string& channel) {
  double largest = 0.0;
  for (const auto& point : record.points) {
    const auto found = point.channels.find(channel);
    if (found == point.channels.end()) continue;
    largest =
        std::fmax(largest, std::fmax(std::abs(found->second.measured), std::abs(found->second.predicted)));
  }
  return largest;
}

}  // namespace imrig
