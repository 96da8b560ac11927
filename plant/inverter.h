#pragma once
// Two-level inverter, averaged over a PWM cycle: the mean of the phase voltages is what was asked for, inside
// the circle |v| <= V_dc/sqrt(3) (the largest that space-vector modulation reaches at every angle); beyond it
// the vector is shortened, its angle kept. With the hexagon as limit the legs' duties clip instead, after the
// min-max zero sequence: the vector becomes the nearest point of the hexagon.

#include <algorithm>
#include <array>
#include <complex>

#include "rig/base/space_vector.h"

namespace imrig::plant {

inline SpaceVector within_circle(SpaceVector asked_V, double dc_link_V) {
  const double limit = dc_link_V / kSqrt3;
  return std::norm(asked_V) > limit * limit ? asked_V * (limit / std::abs(asked_V)) : asked_V;
}

// Share of the cycle for which each leg hangs on the upper rail.
inline std::array<double, 3> duties(SpaceVector asked_V, double dc_link_V) {
  auto d = phases(asked_V);
  const double common = 0.5 * (std::max({d[0], d[1], d[2]}) + std::min({d[0], d[1], d[2]}));
  for (double& x : d) x = std::clamp(0.5 + (x - common) / dc_link_V, 0.0, 1.0);
  return d;
}

inline SpaceVector within_hexagon(SpaceVector asked_V, double dc_link_V) {
  if (std::abs(asked_V) <= dc_link_V / kSqrt3) return asked_V;
  const auto d = duties(asked_V, dc_link_V);
  return dc_link_V * space_vector(d[0], d[1], d[2]);
}

}  // namespace imrig::plant
