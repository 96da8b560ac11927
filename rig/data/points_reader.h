#pragma once
// A table of steady operating points to star-equivalent peak values.

#include <string>
#include <vector>

#include "rig/data/column_table.h"
#include "rig/data/manifest.h"

namespace imrig {

struct PointsRead {
  std::vector<SteadyPoint> points;
  std::vector<std::string> warnings;
  std::string refused;  // why the record cannot be used; empty if it can
  NoiseOf noise = NoiseOf::kRms;
};

// Needs v_rms_V, f_Hz, speed_rpm and at least one of i_rms_A, p_in_W. Throws Error when a column is missing.
PointsRead read_points(const RecordSpec& spec, const ColumnTable& table, Wiring wiring);

}  // namespace imrig
