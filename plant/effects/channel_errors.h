#pragma once
// Errors of three like channels (current sensors or voltage dividers) with stated sizes, beside those that a
// seed draws:
//   y_k = (1 + g_k) [x_k + c x_k^3/r^2 + m (x_(k+1) + x_(k+2))] + o_k:
// gain g, offset o, cross-talk m from the two neighbours, and the cubic departure c of a Hall sensor, as a
// share of its reading at the range r. Source: LEM, Isolated current and voltage transducers, 2004 (gain,
// offset, linearity and the magnetic influence of neighbouring conductors).

#include <array>

#include "plant/effects/effect.h"

namespace imrig::plant {

struct ChannelErrors {
  std::array<double, 3> gain{}, offset{};  // relative; A or V
  double crosstalk = 0.0, cubic = 0.0, range = 40.0;

  bool none() const {
    return gain == std::array<double, 3>{} && offset == std::array<double, 3>{} && crosstalk == 0.0 &&
           cubic == 0.0;
  }
  void apply(double (&x)[3]) const {
    double bent[3];
    for (int k = 0; k < 3; ++k) bent[k] = x[k] * (1.0 + cubic * (x[k] / range) * (x[k] / range));
    for (std::size_t k = 0; k < 3; ++k) {
      x[k] = (1.0 + gain[k]) * (bent[k] + crosstalk * (bent[(k + 1) % 3] + bent[(k + 2) % 3])) + offset[k];
    }
  }
  std::vector<Parameter> parameters(const char* unit) const {
    return {{"gain_a", "1", gain[0]},      {"gain_b", "1", gain[1]},      {"gain_c", "1", gain[2]},
            {"offset_a", unit, offset[0]}, {"offset_b", unit, offset[1]}, {"offset_c", unit, offset[2]},
            {"crosstalk", "1", crosstalk}, {"cubic", "1", cubic},         {"range", unit, range}};
  }
};

}  // namespace imrig::plant
