#include "estimators/fit/start_guess.h"

#include <algorithm>
#include <cmath>
#include <complex>

namespace imrig::est {

std::vector<MachineParameters<double>> guesses_from_point(const SteadyPoint& point, int pole_pairs,
                                                          double R_s) {
  using Complex = std::complex<double>;
  std::vector<MachineParameters<double>> all;
  const double w = 2.0 * kPi * point.f_Hz;
  const double s = 1.0 - pole_pairs * point.speed_rad_s / w;
  const double active = std::min(1.0, point.p_in_W / (1.5 * point.v_peak_V * point.i_peak_A));
  const Complex Z = std::polar(point.v_peak_V / point.i_peak_A, std::acos(std::max(-1.0, active)));
  for (const double share : {0.03, 0.05, 0.08, 0.12, 0.18, 0.26, 0.36, 0.48, 0.62, 0.78}) {
    const double X_l = share * Z.imag();
    const Complex Y = 1.0 / (Z - Complex(R_s, X_l));
    const double R_r = s / Y.real();
    const double L_m = -1.0 / (w * Y.imag());
    const double L_l = X_l / w;
    if (R_r > 0.0 && L_m > L_l && L_m < 200.0 * L_l) all.push_back({R_s, R_r, L_l, L_m});
  }
  return all;
}

std::vector<MachineParameters<double>> guesses_from_impedance(double Z_ohm, double w_rad_s, double R_s) {
  std::vector<MachineParameters<double>> all;
  for (const double magnetizing : {0.4, 1.2, 3.6}) {
    for (const double leakage : {0.05, 0.12, 0.3}) {
      for (const double rotor : {0.01, 0.04, 0.16}) {
        all.push_back(
            {R_s, rotor * Z_ohm, leakage * magnetizing * Z_ohm / w_rad_s, magnetizing * Z_ohm / w_rad_s});
      }
    }
  }
  return all;
}

}  // namespace imrig::est
