#pragma once
// Columns by the names imrig gives them: renamed, scaled and offset as the manifest says.

#include <string>
#include <vector>

#include "rig/data/column_table.h"
#include "rig/data/manifest.h"

namespace imrig {

class ColumnPicker {
 public:
  // Both must outlive the picker.
  ColumnPicker(const RecordSpec& spec, const ColumnTable& table);

  // Whether the file has the column. Throws Error when the manifest renames it from one that is not there.
  bool has(const std::string& name) const;
  // Values; empty if there is no such column. Throws Error when its length differs from the columns taken
  // before.
  std::vector<double> take(const std::string& name);
  // Values of a column that must be there. Throws Error that names the file's columns.
  std::vector<double> need(const std::string& name);
  // Columns of the file that nobody took.
  std::vector<std::string> unused() const;
  std::size_t rows() const { return rows_; }

 private:
  std::string source_of(const std::string& name) const;
  // Throws Error where the file's own unit is another and no scale was given.
  void check_unit(const std::string& name, const std::string& source) const;

  const RecordSpec& spec_;
  const ColumnTable& table_;
  std::vector<std::string> taken_;
  std::size_t rows_ = 0;
};

}  // namespace imrig
