#include "bench/hidden/sensor_noise.h"

#include <cmath>

namespace imrig::bench {

const std::vector<NoiseFlavour>& noise_flavours() {
  static const std::vector<NoiseFlavour> all{
      {"noise_half", 0.5},          {"noise_triple", 3.0},
      {"coloured", 1.0, 1.0, 0.8},  {"heavy_tailed", 1.0, 1.0, 0.0, true},
      {"declared_half", 1.0, 0.5},  {"declared_double", 1.0, 2.0},
  };
  return all;
}

double FlavouredNoise::next() {
  // Variance of Student's t of n degrees of freedom: n/(n - 2).
  const double fresh = flavour_.heavy ? heavy_(bits_) / std::sqrt(2.0) : normal_(bits_);
  state_ = flavour_.colour * state_ + std::sqrt(1.0 - flavour_.colour * flavour_.colour) * fresh;
  return state_;
}

}  // namespace imrig::bench
