#pragma once
// Two motors that need no model: one by Kloss's formula, whose torque and current can be had by hand, and one
// by the phasor circuit of the 2002 paper's equation (9).

#include <cmath>
#include <complex>

#include "rig/base/space_vector.h"
#include "rig/campaign/feasibility.h"

namespace imrig::test {

// T = T_po (V/V_0)^2 (f_0/f)^2 2/(s/s_po + s_po/s), |I| = 100 A * slip.
inline SteadyPredictor kloss(double pull_out_Nm, double pull_out_slip, double rated_V, double rated_Hz) {
  return [=](double v, double f, double slip) {
    const double flux = v / rated_V * rated_Hz / f;
    return SteadyPrediction{100.0 * slip,
                            pull_out_Nm * flux * flux * 2.0 / (slip / pull_out_slip + pull_out_slip / slip)};
  };
}

inline SteadyPredictor circuit(const MotorConfig& m) {
  return [m](double v, double f, double slip) {
    using C = std::complex<double>;
    const double w = 2 * kPi * f;
    const C rotor(m.R_r_ohm / slip, 0.0);
    const C magnetizing(0.0, w * m.L_m_H);
    const C stator(m.R_s_ohm, w * m.L_l_H);
    const C parallel = rotor * magnetizing / (rotor + magnetizing);
    const C i = v / (stator + parallel);
    const C i_r = i * magnetizing / (rotor + magnetizing);
    return SteadyPrediction{std::abs(i), 1.5 * m.pole_pairs / w * std::norm(i_r) * m.R_r_ohm / slip};
  };
}

}  // namespace imrig::test
