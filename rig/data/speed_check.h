#pragma once
// Does a measured speed fit the supply's frequency and the pole pairs? A loaded or idling induction motor
// runs within a few per cent of w_sync = 2 pi f / n_p; what is far from it is mostly a unit, a sign or a pole
// number.

#include <string>
#include <vector>

namespace imrig {

// The largest |speed|, with its sign; NaN values are passed over.
double fastest(const std::vector<double>& speed_rad_s);

// One sentence with numbers and the most likely cause, or nothing. may_stand: a low speed is no contradiction
// then.
std::string implausible_speed(double speed_rad_s, double f_Hz, int pole_pairs, bool may_stand);

// A speed counted over too short a window moves in steps, and stands off by up to half of one while it is
// constant: an error that looks like physics. One sentence where that half is more than 0.05 % of slip, or
// nothing.
std::string coarse_speed(const std::vector<double>& speed_rad_s, double f_Hz, int pole_pairs);

}  // namespace imrig
