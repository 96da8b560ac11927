#pragma once
// dataset.toml, read strictly: what the files of a data-set folder hold and mean. docs/data-sets.md describes
// every key.

#include <map>
#include <string>
#include <vector>

#include "rig/data/quantities.h"
#include "rig/data/record.h"

namespace imrig {

// value = scale * cell + offset, from the column of another name.
struct ColumnRule {
  std::string from;
  double scale = 1.0;
  double offset = 0.0;
  bool scaled = false;  // a scale was given
};

struct RecordSpec {
  std::string id;
  RecordKind kind = RecordKind::kFree;
  std::string path;  // of the file, folder included
  double sample_time_s = kMissing;
  double voltage_filter_s = 0.0;
  long long first_index = 0;
  std::string repeat_of;
  bool holdout = false;
  SetPoint set;
  std::map<std::string, ColumnRule> columns;  // by our name
  std::string where;                          // "dataset.toml: record ID", for messages
};

struct Manifest {
  std::string name;
  int pole_pairs = 0;
  Wiring wiring;
  Noise cells;  // of one cell of a column, in SI: not yet star-equivalent
  Accuracy accuracy;
  std::vector<RecordSpec> records;
};

// Names of columns that imrig knows, for time series and for points.
const std::vector<std::string>& series_columns();
const std::vector<std::string>& points_columns();

// folder: where the record's files are. Throws Error.
Manifest parse_manifest(const std::string& text, const std::string& name, const std::string& folder);

}  // namespace imrig
