#pragma once
// Response of the standing motor along one axis (inverse-gamma circuit, flux states):
//   dpsi_s/dt = u - R_s i,  dpsi_r/dt = R_r (i - psi_r/L_m),  i = (psi_s - psi_r)/L_l
// stepped exactly for a voltage on straight lines between samples:
//   x_{k+1} = F x_k + g_0 u_k + g_1 u_{k+1},
//   F = p_0(Ah), g_1 = h p_2(Ah) b, g_0 = h p_1(Ah) b - g_1,  p_m(X) = sum_n X^n/(n+m)!
// T is double or ceres::Jet.

#include <array>
#include <cmath>

#include "estimators/model/base_machine.h"

namespace imrig::est {

template <class T>
struct StandstillStep {
  std::array<T, 4> F{};           // row by row
  std::array<T, 2> g_0{}, g_1{};  // per V
  T per_L_l{};
};

// |A| h must be below kMostStep: the caller's sample time is too long for this motor otherwise.
inline constexpr double kMostStep = 4.0;

template <class T>
StandstillStep<T> standstill_step(const MachineParameters<T>& p, double h) {
  constexpr int kTerms = 40;
  const T stator = p.R_s / p.L_l, rotor = p.R_r / p.L_l;
  const std::array<T, 4> A{-stator * h, stator * h, rotor * h, -(rotor + p.R_r / p.L_m) * h};
  StandstillStep<T> s;
  s.per_L_l = 1.0 / p.L_l;
  // Column 0 of p_1 and p_2 is all that b = (1, 0) needs.
  std::array<T, 4> power{T(1.0), T(0.0), T(0.0), T(1.0)};  // A^n/n!
  std::array<T, 2> p_1{}, p_2{};
  for (int n = 0; n < kTerms; ++n) {
    for (std::size_t k = 0; k < 4; ++k) s.F[k] += power[k];
    for (std::size_t k = 0; k < 2; ++k) {
      p_1[k] += power[2 * k] * (1.0 / (n + 1.0));
      p_2[k] += power[2 * k] * (1.0 / ((n + 1.0) * (n + 2.0)));
    }
    const double part = 1.0 / (n + 1.0);
    power = {(A[0] * power[0] + A[1] * power[2]) * part, (A[0] * power[1] + A[1] * power[3]) * part,
             (A[2] * power[0] + A[3] * power[2]) * part, (A[2] * power[1] + A[3] * power[3]) * part};
  }
  for (std::size_t k = 0; k < 2; ++k) {
    s.g_1[k] = p_2[k] * h;
    s.g_0[k] = p_1[k] * h - s.g_1[k];
  }
  return s;
}

template <class T>
struct StandstillState {
  T psi_s{}, psi_r{};
  T current(const StandstillStep<T>& s) const { return (psi_s - psi_r) * s.per_L_l; }
  void advance(const StandstillStep<T>& s, double u, double u_next) {
    const T new_s = s.F[0] * psi_s + s.F[1] * psi_r + s.g_0[0] * u + s.g_1[0] * u_next;
    psi_r = s.F[2] * psi_s + s.F[3] * psi_r + s.g_0[1] * u + s.g_1[1] * u_next;
    psi_s = new_s;
  }
};

}  // namespace imrig::est
