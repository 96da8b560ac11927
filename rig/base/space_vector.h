#pragma once
// Complex space vectors, amplitude-invariant: x = (2/3)(x_a + a x_b + a^2 x_c), a = exp(j 2 pi/3); |x| is the peak of the phase
// quantity. P = (3/2) Re(v i*), T = (3/2) n_p Im(psi_s* i_s). The zero-sequence part is dropped: no neutral is connected.

#include <array>
#include <cmath>
#include <complex>
#include <numbers>

namespace imrig {

using SpaceVector = std::complex<double>;

inline constexpr double kPi = std::numbers::pi;
inline constexpr double kSqrt3 = std::numbers::sqrt3;

inline constexpr double rad_s_of_rpm(double rpm) { return rpm * (2.0 * kPi / 60.0); }
inline constexpr double rpm_of_rad_s(double rad_s) { return rad_s * (60.0 / (2.0 * kPi)); }

// Phase quantities (any unit) to the space vector of the same unit.
inline SpaceVector space_vector(double a, double b, double c) {
  return {(2.0 * a - b - c) / 3.0, (b - c) / kSqrt3};
}

// Phase values a, b, c of a space vector; they sum to zero.
inline std::array<double, 3> phases(SpaceVector x) {
  const double half = -0.5 * x.real();
  const double quadrature = 0.5 * kSqrt3 * x.imag();
  return {x.real(), half + quadrature, half - quadrature};
}

// Instantaneous three-phase power in W from peak-valued vectors in V and A.
inline double power_W(SpaceVector v, SpaceVector i) { return 1.5 * (v * std::conj(i)).real(); }

}  // namespace imrig
