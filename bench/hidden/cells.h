#pragma once
// What can be hidden in a data set, and how strongly. A cell names the physics of the plant, and what the
// library of the fitted model calls it.

#include <string>
#include <vector>

#include "bench/hidden/machine.h"

namespace imrig::bench {

enum class Strength { kWeak, kMedium, kStrong };
const char* word(Strength strength);

struct Cell {
  std::string name;
  std::vector<std::string> hidden;  // of kinds(); none: nothing is missing
};

struct Kind {
  std::string name;
  std::string truth;       // as the model's library calls it; empty: the library has no such physics
  bool commanded = false;  // it shows only beside the voltages that were asked for
};

const std::vector<Kind>& kinds();
const Kind& kind(const std::string& name);  // throws Error
const std::vector<Cell>& cells();
const Cell& cell(const std::string& name);  // throws Error

// What a kind does to the data: lines of the plant's file, and errors outside it. `warmth` 0..1 is the heat
// of one record.
struct Flaw {
  std::string effects;  // [effects.NAME] tables
  std::string inverter, sensors;
  double current_range = 1.0;  // of the converters, relative
  double extra_lag_s = 0.0;    // of the voltage channels, not declared
  double speed_gain = 0.0;
};
void add_flaw(const Machine& machine, const std::string& kind, Strength strength, double warmth, Flaw& flaw);

}  // namespace imrig::bench
