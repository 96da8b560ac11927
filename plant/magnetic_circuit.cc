#include "plant/magnetic_circuit.h"

#include <cmath>

#include "rig/base/error.h"

namespace imrig::plant {
namespace {

using Complex = std::complex<double>;

constexpr double kConverged = 2e-8;  // of the fluxes; Newton's next step would be its square

bool straight(const SaturationLaw& law) { return law.saturated_ratio == 1.0; }

// knee_Wb: flux at which the branch bends.
TwoSlope extra(const SaturationLaw& law, double inductance_H, double knee_Wb) {
  if (straight(law)) return {};
  return {(1.0 / law.saturated_ratio - 1.0) / inductance_H, knee_Wb, law.softness};
}

}  // namespace

Complex MagneticCircuit::Branch::add(Complex psi, double weight, Matrix2& jacobian) const {
  if (extra.none()) {
    jacobian.xx += weight * base, jacobian.yy += weight * base;
    return base * psi;
  }
  const TwoSlope::Tangent t = extra.tangent(std::norm(psi));
  const double secant = base + t.secant, rank = weight * t.rank, x = psi.real(), y = psi.imag();
  jacobian.xx += weight * secant + rank * x * x, jacobian.yy += weight * secant + rank * y * y;
  jacobian.xy += rank * x * y, jacobian.yx += rank * x * y;
  return secant * psi;
}

double MagneticCircuit::Branch::energy(Complex psi) const {
  return 0.5 * base * std::norm(psi) + extra.energy(std::abs(psi));
}

MagneticCircuit::MagneticCircuit(const MachineConfig& machine, const MagneticLaws& laws)
    : machine_(machine),
      linear_(straight(laws.main) && straight(laws.stator_leakage) && straight(laws.rotor_leakage) &&
              straight(laws.teeth)),
      share_(laws.leakage_in_teeth) {
  const double L_m = machine.L_m_H, L_ls = machine.L_s_H - L_m, L_lr = machine.L_r_H - L_m;
  if (linear_) return;
  if (!(L_ls > 0.0 && L_lr > 0.0)) {
    throw Error("motor", "saturation needs a T circuit with leakage on both sides",
                "L_s_H and L_r_H above L_m_H, or circuit = \"inverse-gamma\"");
  }
  main_ = {1.0 / L_m, extra(laws.main, L_m, laws.main.knee)};
  teeth_ = {0.0, extra(laws.teeth, L_m, laws.teeth.knee)};
  stator_ = {1.0 / L_ls, extra(laws.stator_leakage, L_ls, L_ls * laws.stator_leakage.knee)};
  rotor_ = {1.0 / L_lr, extra(laws.rotor_leakage, L_lr, L_lr * laws.rotor_leakage.knee)};
}

// The residual is the sum of the currents that leave the air gap's node; its Jacobian is symmetric and
// positive definite, so a short enough step along Newton's direction always lessens it. The last step is so
// short that the branches' tangents give the currents behind it.
MagneticCircuit::Point MagneticCircuit::solve(Complex psi_s, Complex psi_r) const {
  const double c = share_, rest = 1.0 - c;
  const double enough = kConverged * (std::abs(psi_s) + std::abs(psi_r));
  Complex at = (stator_.base * psi_s + rotor_.base * psi_r) / (stator_.base + rotor_.base + main_.base);
  Complex step = 0.0;
  Currents i;
  double last = INFINITY;
  for (int round = 0; round < kMostRounds; ++round) {
    Matrix2 s, r, t, node;
    Complex residual = main_.add(at, 1.0, node), i_t = 0.0;
    i.s = stator_.add(psi_s - at, 1.0, s), i.r = rotor_.add(psi_r - at, 1.0, r);
    residual -= i.s + i.r;
    node = node + s + r;
    if (!teeth_.extra.none()) {
      i_t = teeth_.add(teeth_flux(psi_s, at), 1.0, t);
      residual += rest * i_t;
      node = node + rest * rest * t;
    }
    const double size = std::norm(residual);
    if (size > last) {
      step *= 0.5;
      at -= step;
      continue;
    }
    last = size;
    step = -(inverse(node) * residual);
    at += step;
    i.s -= s * step, i.r -= r * step;
    if (c != 0.0) i.s += c * (i_t + rest * (t * step));
    if (std::abs(step.real()) + std::abs(step.imag()) <= enough) break;
  }
  return {at, i};
}

MagneticCircuit::Incremental MagneticCircuit::incremental(Complex psi_s, Complex psi_r) const {
  const Complex psi_m = solve(psi_s, psi_r).psi_m;
  Matrix2 s, r, m, t;
  stator_.add(psi_s - psi_m, 1.0, s), rotor_.add(psi_r - psi_m, 1.0, r), main_.add(psi_m, 1.0, m);
  teeth_.add(teeth_flux(psi_s, psi_m), 1.0, t);
  // Second derivatives of the energy by psi_s, psi_r and psi_m; psi_m is then eliminated.
  const double c = share_, rest = 1.0 - c;
  const Matrix2 node = inverse(s + r + m + rest * rest * t);
  const Matrix2 across = c * rest * t - s;
  const Matrix2 via = across * node;
  return {s + c * c * t - via * across, via * r, r - r * node * r};
}

double MagneticCircuit::energy_J(Complex psi_s, Complex psi_r) const {
  const Complex psi_m = solve(psi_s, psi_r).psi_m;
  return 1.5 * (stator_.energy(psi_s - psi_m) + rotor_.energy(psi_r - psi_m) + main_.energy(psi_m) +
                teeth_.energy(teeth_flux(psi_s, psi_m)));
}

// With psi_m held the currents answer the fluxes most strongly.
double MagneticCircuit::fastest_rate(double R_s_ohm, double R_r_ohm) const {
  return R_s_ohm *
             (stator_.base + stator_.extra.final_slope() + share_ * share_ * teeth_.extra.final_slope()) +
         R_r_ohm * (rotor_.base + rotor_.extra.final_slope());
}

}  // namespace imrig::plant
