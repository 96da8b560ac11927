#pragma once
// From what an instrument measured to the star-equivalent space vector: the star that behaves at the
// terminals like the motor.
//
//   connection, columns   voltage columns            current columns            star-equivalent
//   star, phase           v_a  v_b  v_c              i_a  i_b  i_c              v, i
//   star, line            v_ab v_bc v_ca             i_a  i_b  i_c              v/(sqrt3 e^{j30}), i
//   delta, phase          v_ab v_bc v_ca (windings)  i_ab i_bc i_ca (windings)  v/(sqrt3 e^{j30}), i sqrt3
//   e^{-j30} delta, line           v_ab v_bc v_ca             i_a  i_b  i_c              v/(sqrt3 e^{j30}), i
//   star_equivalent       anything already converted, as export writes it      v, i
//
// From x_ab = x_a - x_b and amplitude-invariant vectors: v_line = (1 - a^2) v, i_line = (1 - a) i_winding.
// Alpha and beta columns are the space vector of the columns they replace, so the same factors hold. Winding
// resistances and inductances of a delta are 3 times the star's.

#include "rig/base/space_vector.h"
#include "rig/data/record.h"

namespace imrig {

enum class Quantities { kPhase, kLine, kStarEquivalent };

struct Wiring {
  bool delta = false;
  Quantities quantities = Quantities::kPhase;
};

// Factors that the space vector of the columns is multiplied by. Their absolute values hold for rms and peak
// values as well.
SpaceVector voltage_to_star(Wiring wiring);
SpaceVector current_to_star(Wiring wiring);

enum class NoiseOf { kThreePhases, kTwoPhases, kAlphaBeta, kRms, kPeak };
// Noise of one cell of a column to the noise of each component of the star-equivalent vector. A vector made
// of three noisy phases has components with sqrt(2/3) of a phase's sigma, one whose third phase is minus the
// sum of two has sqrt(4/3) on average; a table's rms value has sqrt(2) of it as a peak value.
double cell_to_component(NoiseOf kind);

}  // namespace imrig
