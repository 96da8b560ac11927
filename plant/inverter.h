#pragma once
// Averaged two-level inverter: the mean of the phase voltages over a PWM cycle is what was asked for, inside
// the circle |v| <= V_dc/sqrt(3) (the largest that space-vector modulation reaches at every angle); beyond it
// the vector is shortened, its angle kept. The DC link is stiff.

#include <complex>

#include "rig/base/space_vector.h"

namespace imrig::plant {

inline SpaceVector averaged_inverter(SpaceVector asked_V, double dc_link_V) {
  const double limit = dc_link_V / kSqrt3;
  const double amplitude = std::abs(asked_V);
  return amplitude > limit ? asked_V * (limit / amplitude) : asked_V;
}

}  // namespace imrig::plant
