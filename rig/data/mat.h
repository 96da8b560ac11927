#pragma once
// MATLAB .mat files (level 4, 5 and 7.3, by libmatio): every real numeric vector at the top level is a column
// of its variable's name. Scalars, matrices, text, structs and cells are left out.

#include <string>

#include "rig/data/column_table.h"

namespace imrig {

// Columns may differ in length; whoever uses them checks. Throws Error: no .mat file, no vector in it, more
// than 2^28 values.
ColumnTable read_mat(const std::string& path);

}  // namespace imrig
