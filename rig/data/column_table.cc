#include "rig/data/column_table.h"

#include <algorithm>

namespace imrig {

int ColumnTable::find(const std::string& name) const {
  const auto found = std::find(names.begin(), names.end(), name);
  return found == names.end() ? -1 : static_cast<int>(found - names.begin());
}

std::string ColumnTable::where(std::size_t row) const {
  if (row < lines.size()) return file + ":" + std::to_string(lines[row]);
  return file + " row " + std::to_string(row + 1);
}

}  // namespace imrig
