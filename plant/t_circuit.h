#pragma once
// The motor's magnetic circuit in T form: psi_s = L_s i_s + L_m i_r, psi_r = L_m i_s + L_r i_r, both in the
// stator's frame and turns. Currents follow from the fluxes by inverting the 2x2 matrix; with D = L_s L_r -
// L_m^2:
//   i_s = (L_r psi_s - L_m psi_r)/D,   i_r = (L_s psi_r - L_m psi_s)/D.

#include <complex>

#include "plant/effects/effect.h"
#include "plant/plant_config.h"

namespace imrig::plant {

class TCircuit {
 public:
  explicit TCircuit(const MachineConfig& machine)
      : L_s_(machine.L_s_H), L_r_(machine.L_r_H), L_m_(machine.L_m_H), D_(L_s_ * L_r_ - L_m_ * L_m_) {}

  Currents currents(std::complex<double> psi_s, std::complex<double> psi_r) const {
    return {(L_r_ * psi_s - L_m_ * psi_r) / D_, (L_s_ * psi_r - L_m_ * psi_s) / D_};
  }
  double transient_inductance() const { return D_ / L_r_; }  // d psi_s / d i_s at fixed psi_r
  double coupling() const { return L_m_ / L_r_; }            // d psi_s / d psi_r at fixed i_s

 private:
  double L_s_, L_r_, L_m_, D_;
};

}  // namespace imrig::plant
