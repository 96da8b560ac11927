#pragma once
// Named columns of numbers, as a file holds them: before any meaning, unit or conversion.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace imrig {

struct ColumnTable {
  std::string file;                          // for messages
  std::vector<std::string> names;            // unique
  std::vector<std::vector<double>> columns;  // one per name; NaN where the cell was empty
  std::vector<std::string> units;  // of the row under the names, one per name; empty without such a row
  std::vector<std::uint32_t> lines;          // of each row in a text file; empty where the file has no lines

  // The column's index, or -1.
  int find(const std::string& name) const;
  // "FILE:LINE" of a row, or "FILE row N" (from 1) where there are no lines.
  std::string where(std::size_t row) const;
};

}  // namespace imrig
