#pragma once
// CSV as labs write it: one header line of names, then numbers. Separator comma, semicolon or tab (the one
// most frequent in the header); decimal comma where the separator is not a comma; quoted names and cells;
// byte-order mark; LF, CR LF; lines that start with # are comments; blank lines are skipped; an empty cell,
// NaN or NA is a missing value; a row of units under the names is kept apart. Every complaint names file,
// line and column.

#include <cstddef>
#include <string>
#include <string_view>

#include "rig/data/column_table.h"

namespace imrig {

struct CsvLimits {
  std::size_t max_bytes = std::size_t{1} << 31;
  std::size_t max_columns = 1024;
  std::size_t max_cells = std::size_t{1} << 28;
};

// Throws Error: no header, a name missing or twice, a row with too few or too many cells, text where a number
// belongs, a limit passed.
ColumnTable parse_csv(std::string_view text, const std::string& name, const CsvLimits& limits = {});
ColumnTable read_csv(const std::string& path, const CsvLimits& limits = {});

}  // namespace imrig
