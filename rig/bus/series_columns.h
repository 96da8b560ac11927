#pragma once
// Imported time series and points: messages of at most 500 rows to columns, and back. Exact to the bit both
// ways.

#include <cstdint>
#include <imrig_msg/points_t.hpp>
#include <imrig_msg/series_t.hpp>
#include <string>

#include "rig/bus/record_collector.h"
#include "rig/data/record.h"

namespace imrig {

inline constexpr std::size_t kRowsPerMessage = 500;

// Fills record.series or record.points from the messages. Returns why that cannot be done; empty when it was.
std::string join_columns(const RawRecord& raw, Record& record);

// Rows first .. first+n-1, n <= kRowsPerMessage. Head and number are the caller's.
imrig_msg::series_t series_rows(const TimeSeries& series, std::size_t first, std::size_t n);
imrig_msg::points_t point_rows(const std::vector<SteadyPoint>& points, std::size_t first, std::size_t n);

}  // namespace imrig
