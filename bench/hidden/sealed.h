#pragma once
// A sealed data set: records that the plant library made, and apart from them what was hidden in the plant.
// Every record holds the shaft at a speed, drives the motor with a turning voltage whose amplitude steps up
// and down again by a tenth to a fifth, and hands over what sensors and converters show, thinned. Zeros of
// the sensors are taken with the gates off, as a rig does.

#include <cstdint>
#include <string>
#include <vector>

#include "bench/hidden/cells.h"
#include "rig/data/record.h"

namespace imrig::bench {

struct Seal {
  std::string cell;
  Strength strength = Strength::kMedium;
  std::uint64_t seed = 0;
  std::vector<std::string> truth;  // in the model's library's words
  std::vector<std::string> hidden; // of kinds()
  bool outside = false;            // the library has no such physics
  bool exact = false;              // the fitted model can be the plant: its base parameters are the machine's
  Machine machine;
};

struct Sealed {
  DataSet data;
  Seal seal;
};

struct SealOptions {
  double record_s = 0.24;
  int thin = 4;       // of 60 us
  std::size_t held_out = 40;
  bool poor = false;  // frequency x load at 80 % of rated volts per hertz, and no more
};

Sealed make_sealed(const Cell& cell, Strength strength, std::uint64_t seed, const SealOptions& options = {});

// A record that somebody asks for after the seal was made.
struct Wanted {
  double f_Hz = 0.0, v_V = 0.0, step = 0.0, slip = 0.0;  // slip per unit, 1 at rest
  bool axis = false;                                     // along one axis
  double warmth = 0.5;                                   // 0 cold, 1 hot
  double length_s = 0.25;
};

// Takes them on the same plant, fresh noise each, behind those that are there.
void take_more(const Cell& cell, const std::vector<Wanted>& wanted, Sealed& sealed,
               const SealOptions& options = {});

}  // namespace imrig::bench
