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
  bool outside = false;            // the library has no such physics
  Machine machine;
};

struct Sealed {
  DataSet data;
  Seal seal;
};

struct SealOptions {
  double record_s = 0.24;
  int thin = 4;  // of 60 us
};

Sealed make_sealed(const Cell& cell, Strength strength, std::uint64_t seed, const SealOptions& options = {});

}  // namespace imrig::bench
