#pragma once
// The row of units that many loggers write under the names: "(ms),(V),(A)". It is no data, but it may
// contradict the names that a data set gives its columns.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace imrig {

// Whether these cells (unquoted) are units: at least half of those that hold anything are known ones, and
// none is a number.
bool is_unit_row(const std::vector<std::string>& cells);

// What a value in `told` is multiplied with to be in the unit that our column's name ends in (t_s, v_a_V,
// speed_rpm, ...). Empty where either is not known; NaN where they are of different kinds.
std::optional<double> unit_factor(std::string_view our_name, std::string_view told);

}  // namespace imrig
