#pragma once
// What can be hidden in a data set, and how strongly. A cell names the physics of the plant, and what the
// library of the fitted model calls it.

#include <string>
#include <vector>

#include "bench/hidden/machine.h"
#include "bench/hidden/sensor_noise.h"

namespace imrig::bench {

enum class Strength { kWeak, kMedium, kStrong };
const char* word(Strength strength);

struct Cell {
  std::string name;
  std::vector<std::string> hidden = {};  // of kinds(); none: nothing is missing
  int drawn = 0;                         // so many more kinds, drawn by the seed
  bool removed = false;                  // what is hidden is taken out of the library
  NoiseFlavour noise = {};
  std::string other_machine = {};        // no induction motor at all: permanent_magnet, reluctance
  bool torque = false;                   // the shaft's torque is measured
};

struct Kind {
  std::string name;
  std::string truth;       // as the model's library calls it; empty: the library has no such physics
  bool commanded = false;  // it shows only beside the voltages that were asked for
  std::string alike = {};  // the library's effect with the same equation, which says so
  bool exact = false;      // the library's law is the plant's, and leaves the base parameters what they are
  bool torque = false;     // it shows only where the shaft's torque is measured
};

const std::vector<Kind>& kinds();
const Kind& kind(const std::string& name);  // throws Error
const std::vector<Cell>& cells();
const Cell& cell(const std::string& name);  // throws Error
std::vector<std::string> hidden_in(const Cell& cell, std::uint64_t seed);  // of kinds()

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
