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
// residual grows, at most kMostRounds evaluations; the same fluxes give the same bits. Saturation is a
// function of the fluxes alone: no hysteresis, no harmonic of the saturated wave. Sources: Melkebeek,
// Magnetising-field saturation and dynamic behaviour of induction machines, IEE Proc. B 130(1), 1983;
// Sullivan and Sanders, Models for induction machines with magnetic saturation of the main flux path, IEEE
// Trans. Ind. Appl. 31(4), 1995 (the branches of a lumped circuit, each its own curve, and reciprocity from
// an energy).

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

  // Throws Error where the laws are bent and the circuit has no positive leakage on both sides.
  MagneticCircuit(const MachineConfig& machine, const MagneticLaws& laws);

  bool linear() const { return linear_; }
  const MachineConfig& machine() const { return machine_; }
  // The following are for the bent circuit.
  Point solve(std::complex<double> psi_s, std::complex<double> psi_r) const;
  Incremental incremental(std::complex<double> psi_s, std::complex<double> psi_r) const;
  double energy_J(std::complex<double> psi_s, std::complex<double> psi_r) const;
  // Bound on the fastest decay with these resistances, 1/s.
  double fastest_rate(double R_s_ohm, double R_r_ohm) const;

  static constexpr int kMostRounds = 60;

 private:
  struct Branch {
    double base = 0.0;  // 1/H
    TwoSlope extra;
    // Adds the branch's Jacobian times `weight`; returns its current.
    std::complex<double> add(std::complex<double> psi, double weight, Matrix2& jacobian) const;
    double energy(std::complex<double> psi) const;
  };
  std::complex<double> teeth_flux(std::complex<double> psi_s, std::complex<double> psi_m) const {
    return psi_m + share_ * (psi_s - psi_m);
  }

  MachineConfig machine_;
  bool linear_;
  Branch stator_, rotor_, main_, teeth_;
  double share_;
};

}  // namespace imrig::plant
