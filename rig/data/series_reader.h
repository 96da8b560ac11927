#pragma once
// Columns of one record to a uniform, star-equivalent time series.

#include <string>
#include <vector>

#include "rig/data/column_table.h"
#include "rig/data/manifest.h"

namespace imrig {

struct SeriesRead {
  TimeSeries series;
  std::vector<std::string> warnings;
  std::string refused;  // why the record cannot be used; empty if it can
  NoiseOf current = NoiseOf::kThreePhases;
  NoiseOf voltage = NoiseOf::kThreePhases;
};

// Throws Error when a needed column is missing or columns differ in length: that is the manifest's fault, not
// the data's. Kinds dc, standstill and locked_sweep may leave out the speed: the shaft stands still then.
SeriesRead read_series(const RecordSpec& spec, const ColumnTable& table, Wiring wiring);

}  // namespace imrig
