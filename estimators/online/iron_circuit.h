#pragma once
// The base machine with a main flux that saturates and iron that takes power, as a filter needs it: cheap enough for
// every sample. Stator frame; the forms are those of the model's effects (magnetizing_saturation.h, core_loss.h),
//   i_l = (psi_s - psi_r)/L_l,   psi_x = psi_r + (1 - place)(psi_s - psi_r),   i_x = g(|psi_x|) psi_x/L_m
//   i   = (i_l + (1 - place) i_x + G_s v)/(1 + G_s R_s)
//   i_r = (i_l - psi_r/L_m - place i_x - j w_r G_r psi_r)/(1 + G_r R_r)
//   dpsi_s/dt = v - R_s i,   dpsi_r/dt = R_r i_r + j w_r psi_r
// g and the iron's conductances, which change slowly, are held between two calls of settle().

#include <complex>

#include "estimators/model/base_machine.h"
#include "estimators/online/r_r_observer/rotor_resistance.h"

namespace imrig::est {

struct IronConfig {
  MagneticCurve saturation;
  double eddy_S = 0.0, hysteresis_S_rad_s = 0.0, place = 0.5;  // of the core loss
  bool any() const { return !saturation.none() || eddy_S > 0.0 || hysteresis_S_rad_s > 0.0; }
};

class IronCircuit {
 public:
  using Complex = std::complex<double>;
  struct Currents {
    Complex stator, rotor, magnetizing;  // terminals; into the cage; what L_m and its saturation take at the rotor
  };

  explicit IronCircuit(const IronConfig& config) : c_(config) {}

  void settle(Complex psi_s, Complex psi_r, double w_r) {
    if (!c_.saturation.none()) g_ = c_.saturation.share(saturating(psi_s, psi_r));
    const double G = c_.eddy_S + c_.hysteresis_S_rad_s / std::max(std::abs(w_r), kSlowest_rad_s);
    G_r_ = c_.place * G;
    G_s_ = (1.0 - c_.place) * G;
  }

  Currents currents(const MachineParameters<double>& p, Complex psi_s, Complex psi_r, Complex v, double w_r) const {
    const double place = c_.saturation.place();
    const Complex i_l = (psi_s - psi_r) / p.L_l, i_x = (g_ / p.L_m) * saturating(psi_s, psi_r);
    Currents out;
    out.magnetizing = psi_r / p.L_m + place * i_x;
    out.stator = (i_l + (1.0 - place) * i_x + G_s_ * v) / (1.0 + G_s_ * p.R_s);
    out.rotor = (i_l - out.magnetizing - Complex(0.0, w_r * G_r_) * psi_r) / (1.0 + G_r_ * p.R_r);
    return out;
  }

 private:
  Complex saturating(Complex psi_s, Complex psi_r) const {
    return psi_r + (1.0 - c_.saturation.place()) * (psi_s - psi_r);
  }

  static constexpr double kSlowest_rad_s = 6.0;  // below it the iron has no EMF to speak of
  IronConfig c_;
  double g_ = 0.0, G_s_ = 0.0, G_r_ = 0.0;
};

}  // namespace imrig::est
