#pragma once
// Where a model fails: error of every channel over each operating condition, in bins that the data choose,
// and a test of whether the error depends on the condition at all.
//   bins    the values' own clusters where there are few, else sixths of the data; at least 4 stretches each
//   test    figures of each unit: log of the current error's mean square over its noise, and the signed
//   errors
//           (stretch.h), against every condition (shuffle_test.h, fixed seed); p_value is family-wise
//   units   records, or points of a table; of fewer than 8 records their stretches, which are not shuffled
//           but shifted in a circle, since neighbours are alike
// Conditions that hardly vary have no bins: these data say nothing about them.

#include <string>
#include <vector>

#include "estimators/diagnose/stretch.h"

namespace imrig::est {

struct MapBin {
  double low = kMissing, high = kMissing;  // smallest and largest value in it
  std::size_t stretches = 0, records = 0;
  Channels channels;
};

struct MapCondition {
  std::string name;  // f_Hz, psi_Wb, slip, i_A, torque_Nm, stator_C, time_s or order, direction
  std::vector<MapBin> bins;
  double p_value = kMissing;
  double share = kMissing;  // of the variation of that figure that the bins explain, less what chance would
  std::string channel = "current_A";  // the figure that depends on it most is of this channel
  std::string part;                   // "size", "active", "reactive" or "sign"; empty: not tested
};

struct FailureMap {
  std::string from;      // "time series" or "points"
  std::string shuffled;  // "records", "points", "stretches"; empty: too few to test
  std::size_t stretches = 0, records = 0;
  std::vector<MapCondition> conditions;
};

// stretches of each record, in the data set's order.
FailureMap failure_map(const std::vector<const std::vector<Stretch>*>& records, const std::string& from,
                       std::uint64_t seed);

}  // namespace imrig::est
