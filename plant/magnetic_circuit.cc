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
  const double curvature = main_.extra.curvature() + teeth_.extra.curvature() + stator_.extra.curvature() +
                           rotor_.extra.curvature();  // A/Wb^2
  near_Wb2_ = kFollowed_A / curvature;
}

// The residual is the sum of the currents that leave the air gap's node; its Jacobian is symmetric and
// positive definite, so a short enough step along Newton's direction always lessens it. The last step is so
// short that the branches' tangents give the currents behind it.
MagneticCircuit::Point MagneticCircuit::solve(Complex psi_s, Complex psi_r) const {
  const double enough = kConverged * (std::abs(psi_s) + std::abs(psi_r));
  Known known;
  known.psi_s = psi_s, known.psi_r = psi_r;
  known.psi_m = (stator_.base * psi_s + rotor_.base * psi_r) / (stator_.base + rotor_.base + main_.base);
  Complex step = 0.0;
  double last = INFINITY;
  for (int round = 0; round < kMostRounds; ++round) {
    const Complex from = known.psi_m;
    const Step next = step_from<false>(from, known);
    const double size = std::norm(next.residual);
    if (size > last) {
      step *= 0.5;
      known.psi_m = from - step;
      continue;
    }
    last = size, step = next.psi;
    if (std::abs(step.real()) + std::abs(step.imag()) <= enough) break;
  }
  return {known.psi_m, known.i};
}

MagneticCircuit::Incremental MagneticCircuit::incremental(Complex psi_s, Complex psi_r) const {
  Known known;
  known.psi_s = psi_s, known.psi_r = psi_r;
  step_from<false>(solve(psi_s, psi_r).psi_m, known);
  return incremental(known);
}

// Second derivatives of the energy by psi_s, psi_r and psi_m; psi_m is then eliminated.
MagneticCircuit::Incremental MagneticCircuit::incremental(const Known& known) const {
  const auto full = [](const Symmetric2& a) { return Matrix2{a.xx, a.xy, a.xy, a.yy}; };
  const Matrix2 s = full(known.s), r = full(known.r), t = full(known.t), node = full(known.node);
  const double c = share_, rest = 1.0 - c;
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
