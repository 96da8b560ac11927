#pragma once
// Single cells that a logger lost. Holes of at most three rows between at least two whole rows on each side
// are filled by the cubic through these four: of a sine of w it misses up to 1.5 (w h)^4 of the amplitude,
// 1e-6 at 50 Hz and 60 us, 1e-3 at 2 kHz. Longer holes stay, and so do all when more than one row in a
// hundred has one.

#include <cstddef>
#include <vector>

namespace imrig {

inline constexpr std::size_t kLongestHole = 3;  // rows

// x of the same length as t_s; a hole beside a gap in time (1.5 times the median step) stays. Returns how
// many values were filled.
std::size_t fill_short_holes(const std::vector<double>& t_s, std::vector<double>& x);

}  // namespace imrig
