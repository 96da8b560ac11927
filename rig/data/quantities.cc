#include "rig/data/quantities.h"

#include <cmath>
#include <numbers>

namespace imrig {

namespace {
// 1 - a^2 = sqrt3 e^{j30} exactly, written by its components so that no rounding of angles enters.
constexpr SpaceVector kPhaseToPhase{1.5, 0.5 * kSqrt3};
}  // namespace

SpaceVector voltage_to_star(Wiring wiring) {
  if (wiring.quantities == Quantities::kStarEquivalent) return {1.0, 0.0};
  const bool between_terminals = wiring.delta || wiring.quantities == Quantities::kLine;
  return between_terminals ? 1.0 / kPhaseToPhase : SpaceVector{1.0, 0.0};
}

SpaceVector current_to_star(Wiring wiring) {
  const bool windings = wiring.delta && wiring.quantities == Quantities::kPhase;
  return windings ? std::conj(kPhaseToPhase) : SpaceVector{1.0, 0.0};
}

double cell_to_component(NoiseOf kind) {
  switch (kind) {
    case NoiseOf::kThreePhases:
      return std::sqrt(2.0 / 3.0);
    case NoiseOf::kTwoPhases:
      return std::sqrt(4.0 / 3.0);
    case NoiseOf::kRms:
      return std::numbers::sqrt2;
    default:
      return 1.0;
  }
}

}  // namespace imrig
