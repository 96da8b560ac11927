#pragma once
// The motor's magnetic circuit with saturation, T form, from one energy. Between the fluxes psi_s and psi_r
// stands the air-gap flux psi_m, which settles where the stored energy is least:
//   W(psi_s, psi_r) = min over psi_m of
//       E_s(|psi_s - psi_m|) + E_r(|psi_r - psi_m|) + E_m(|psi_m|) + E_t(|psi_m + c (psi_s - psi_m)|),
//   E_b(x) = x^2/(2 L_b) + (what TwoSlope stores),  i_s = dW/dpsi_s,  i_r = dW/dpsi_r.
// E_s, E_r: stator and rotor leakage; E_m: air gap and yoke; E_t: teeth, which carry a share c of the
// stator's leakage flux beside the main flux. Each term is convex, so the minimum is one, the incremental
// matrix is symmetric and positive definite, and around any closed path no energy is gained. W does not
// change when all fluxes turn together, hence Im(psi_s* i_s) = -Im(psi_r* i_r): one torque. W is per axis;
// the motor stores (3/2) W. Solved by Newton's method from the linear circuit's psi_m, steps halved while the
// residual grows, at most kMostRounds evaluations; the same fluxes give the same bits. follow() finds a
// point from a known neighbour instead, within kFollowed_A. Saturation is a
// function of the fluxes alone: no hysteresis, no harmonic of the saturated wave. Sources: the energy
// is stated above and reciprocity follows from it; Lipo and Consoli, Modeling and simulation of induction
// motors with saturable leakage reactances, IEEE Trans. Ind. Appl. 20(1), 1984; Vas, Electrical Machines and
// Drives: A Space-Vector Theory Approach, 1992.

#include <complex>

#include "plant/effects/effect.h"
#include "plant/effects/two_slope.h"
#include "plant/matrix2.h"
#include "plant/plant_config.h"

namespace imrig::plant {

class MagneticCircuit {
 public:
  struct Point {
    std::complex<double> psi_m;  // Wb
    Currents i;                  // A
  };
  // How the currents answer the fluxes, 1/H: d i_s = ss d psi_s + sr d psi_r, d i_r = sr^T d psi_s + rr d
  // psi_r.
  struct Incremental {
    Matrix2 ss, sr, rr;
  };

  // A solved point and the tangents there: 1/H of stator leakage, rotor leakage, teeth; inverse of the sum at
  // the node.
  struct Known {
    std::complex<double> psi_s, psi_r, psi_m;
    Currents i;
    Symmetric2 s, r, t, node;
    TwoSlope::Near near_s, near_r, near_m, near_t;
    bool solved = false;
  };

  // Throws Error where the laws are bent and the circuit has no positive leakage on both sides.
  MagneticCircuit(const MachineConfig& machine, const MagneticLaws& laws);

  bool linear() const { return linear_; }
  const MachineConfig& machine() const { return machine_; }
  // The following are for the bent circuit.
  Point solve(std::complex<double> psi_s, std::complex<double> psi_r) const;
  // The same point from `known` nearby, which moves there unless its tangents still hold.
  Point follow(std::complex<double> psi_s, std::complex<double> psi_r, Known& known) const;
  Incremental incremental(std::complex<double> psi_s, std::complex<double> psi_r) const;
  double energy_J(std::complex<double> psi_s, std::complex<double> psi_r) const;
  // Bound on the fastest decay with these resistances, 1/s.
  double fastest_rate(double R_s_ohm, double R_r_ohm) const;

  static constexpr int kMostRounds = 60;
  static constexpr double kFollowed_A = 1e-4;
  static constexpr int kMostFollowing = 4;

 private:
  struct Branch {
    double base = 0.0;  // 1/H
    TwoSlope extra;
    // Its current; sets its Jacobian. With kFollow by the curve's expansion near the last point.
    template <bool kFollow>
    std::complex<double> current(std::complex<double> psi, Symmetric2& jacobian, TwoSlope::Near& near) const;
    double energy(std::complex<double> psi) const;
  };
  struct Step {
    std::complex<double> psi, residual;  // Wb; A, before the step
    double size2() const { return psi.real() * psi.real() + psi.imag() * psi.imag(); }
  };
  Incremental incremental(const Known& known) const;
  // Takes the air gap node's flux a Newton step from psi_m, and the currents by the tangents at psi_m.
  template <bool kFollow>
  Step step_from(std::complex<double> psi_m, Known& known) const;
  std::complex<double> teeth_flux(std::complex<double> psi_s, std::complex<double> psi_m) const {
    return psi_m + share_ * (psi_s - psi_m);
  }

  MachineConfig machine_;
  bool linear_;
  Branch stator_, rotor_, main_, teeth_;
  double share_;
  double near_Wb2_ = 0.0;  // so near the tangents leave less than kFollowed_A
};

template <bool kFollow>
std::complex<double> MagneticCircuit::Branch::current(std::complex<double> psi, Symmetric2& jacobian,
                                                      TwoSlope::Near& near) const {
  const double x = psi.real(), y = psi.imag();
  TwoSlope::Tangent t{0.0, 0.0};
  if (!extra.none()) t = kFollow ? extra.tangent(x * x + y * y, near) : extra.tangent(x * x + y * y);
  const double secant = base + t.secant;
  jacobian = {secant + t.rank * x * x, t.rank * x * y, secant + t.rank * y * y};
  return secant * psi;
}

template <bool kFollow>
MagneticCircuit::Step MagneticCircuit::step_from(std::complex<double> psi_m, Known& known) const {
  Symmetric2 m;
  std::complex<double> residual = main_.current<kFollow>(psi_m, m, known.near_m);
  known.i = {stator_.current<kFollow>(known.psi_s - psi_m, known.s, known.near_s),
             rotor_.current<kFollow>(known.psi_r - psi_m, known.r, known.near_r)};
  residual -= known.i.s + known.i.r;
  Symmetric2 node = known.s + known.r + m;
  std::complex<double> i_t = 0.0;
  const double c = share_, rest = 1.0 - c;
  if (!teeth_.extra.none()) {
    i_t = teeth_.current<kFollow>(teeth_flux(known.psi_s, psi_m), known.t, known.near_t);
    residual += rest * i_t;
    node = node + rest * rest * known.t;
  }
  known.node = inverse(node);
  const std::complex<double> step = -(known.node * residual);
  known.psi_m = psi_m + step;
  known.i.s -= known.s * step, known.i.r -= known.r * step;
  if (c != 0.0) known.i.s += c * (i_t + rest * (known.t * step));
  return {step, residual};
}

inline MagneticCircuit::Point MagneticCircuit::follow(std::complex<double> psi_s, std::complex<double> psi_r,
                                                      Known& known) const {
  const auto square = [](std::complex<double> x) { return x.real() * x.real() + x.imag() * x.imag(); };
  const double c = share_, rest = 1.0 - c;
  std::complex<double> psi_m;
  if (known.solved) {
    const std::complex<double> d_s = psi_s - known.psi_s, d_r = psi_r - known.psi_r;
    std::complex<double> push = known.s * d_s + known.r * d_r;
    if (c != 0.0) push -= c * rest * (known.t * d_s);
    const std::complex<double> d_m = known.node * push;
    psi_m = known.psi_m + d_m;
    if (square(d_s) + square(d_r) <= near_Wb2_) {
      Currents i = {known.i.s + known.s * (d_s - d_m), known.i.r + known.r * (d_r - d_m)};
      if (c != 0.0) i.s += c * (known.t * (c * d_s + rest * d_m));
      return {psi_m, i};
    }
  } else {
    psi_m = solve(psi_s, psi_r).psi_m;
  }
  known.psi_s = psi_s, known.psi_r = psi_r, known.solved = true;
  for (int round = 0; round < kMostFollowing; ++round) {
    if (step_from<true>(psi_m, known).size2() <= near_Wb2_) return {known.psi_m, known.i};
    psi_m = known.psi_m;
  }
  step_from<false>(solve(psi_s, psi_r).psi_m, known);  // too far for Newton's method without a short step
  return {known.psi_m, known.i};
}

}  // namespace imrig::plant
