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
      : L_r_(machine.L_r_H),
        L_m_(machine.L_m_H),
        D_(machine.L_s_H * L_r_ - L_m_ * L_m_),
        ss_(L_r_ / D_),
        rr_(machine.L_s_H / D_),
        sr_(L_m_ / D_) {}

  Currents currents(std::complex<double> psi_s, std::complex<double> psi_r) const {
    return {ss_ * psi_s - sr_ * psi_r, rr_ * psi_r - sr_ * psi_s};
  }
  double transient_inductance() const { return D_ / L_r_; }  // d psi_s / d i_s at fixed psi_r
  double coupling() const { return L_m_ / L_r_; }            // d psi_s / d psi_r at fixed i_s

 private:
  double L_r_, L_m_, D_;
  double ss_, rr_, sr_;  // inverse matrix, 1/H: a division each time would cost more than the rest
};

}  // namespace imrig::plant
