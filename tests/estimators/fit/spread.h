#pragma once
// What the transient fit makes of one record of a matched machine under many seeds of noise, against the least that any
// unbiased estimator could scatter (Cramer and Rao).

#include <array>

#include "estimators/fit/transient_fit.h"
#include "tests/estimators/fit/synthetic.h"

namespace imrig::est::synthetic {

inline constexpr std::array<const char*, 3> kSpreadNames{"R_r", "L_l", "L_m"};
using Three = std::array<double, 3>;  // in that order

// The inverse-gamma circuit of a motor.
MachineParameters<double> truth_of(const Motor& m);

Three three(const MachineParameters<double>& p);

// Starts at the given parts of the truth, bounds around them.
TransientOptions options_near(const MachineParameters<double>& truth, double R_r, double L_l, double L_m);

// A record that starts off its steady state at a constant voltage. (A step is not exactly on a straight line between
// samples.)
Case released_case(const Motor& motor, std::size_t samples);

// Current noise that makes 0.3 % of the record's current.
double usual_noise_A(const Motor& motor, const Case& c);

// Least standard deviation of R_r, L_l, L_m under white current noise, from differences of the independent generator's
// current: the three parameters and the four numbers of the initial flux (by starting other records a little off).
Three cramer_rao(const Motor& m, const Case& c, double current_A);

struct Spread {
  int seeds = 0, failed = 0;
  Three bias{}, deviation{}, stated{};
  std::array<int, 3> covered{};  // seeds whose 95 % interval holds the truth
};

Spread spread_of(const Motor& m, const TimeSeries& clean, double current_A, double voltage_V, double speed_rad_s, int seeds);

}  // namespace imrig::est::synthetic
