#pragma once
// Deep bar: the rotor's current crowds to the top of the bar, and resistance and slot leakage follow the slip
// frequency. A rectangular bar of height h and resistivity rho in an open slot has the impedance
//   Z = R z coth z,   z^2 = j w_slip tau,   tau = mu_0 h^2/rho,
// that is R K_R + j w (R tau/3) K_X, xi = h sqrt(pi f mu_0/rho):
//   K_R = xi (sinh 2xi + sin 2xi)/(cosh 2xi - cos 2xi),
//   K_X = (3/(2 xi)) (sinh 2xi - sin 2xi)/(cosh 2xi - cos 2xi).
// Here it is a Cauer ladder of four layers, the continued fraction of z coth z (1 + z^2/(3 + z^2/(5 + ...))):
//   v = R (i + 5 i_2 + 9 i_3 + 13 i_4 + tip i_5),   i_{k+1} = i - (i_L1 + ... + i_Lk),
//   L_k (d/dt - j n_p w) i_Lk = the voltage across it,   L_k = R tau/(4k - 1),   stator frame.
// The series that follows the fourth layer is closed by one resistor, tip = 5 R, which keeps the fastest mode
// slow; within 1.3 % of Z up to xi = 6.7, 0.01 % up to xi = 3.
// The bar is a fraction of the rotor's resistance, the rest (end rings) stays as it is. At zero slip
// frequency the ladder is the resistance R and the inductance R tau/3, which rotor_leakage_H() takes out of
// the circuit's rotor leakage: seen from the terminals the base machine at zero slip frequency is unchanged.
// Resistivity follows the cage: R is the fraction of the warm R_r, L_k stay, tau falls as R grows.
// Leakage flux of the slot makes no torque (it crosses the slot, not the gap). Source: Pyrhonen,
// Jokinen, Hrabovcova, Design of Rotating Electrical Machines, 2nd ed., chapter 5; the ladder is Lambert's
// continued fraction of z coth z.

#include <array>
#include <complex>

#include "plant/effects/effect.h"

namespace imrig::plant {

class RotorSkinEffect final : public Effect {
 public:
  struct Config {
    double bar_height_m = 0.0;           // 0: no skin effect
    double resistivity_ohm_m = 2.83e-8;  // at the temperature for which the file gives R_r; aluminium
    double bar_fraction = 0.6;           // of R_r; the rest is in the end rings
  };
  static constexpr int kLayers = 4;

  explicit RotorSkinEffect(const Config& config)
      : config_(config),
        tau_s_(kMu0 * config.bar_height_m * config.bar_height_m / config.resistivity_ohm_m) {}

  std::string name() const override { return "rotor_skin_effect"; }
  unsigned hooks() const override {
    return config_.bar_height_m > 0.0 && config_.bar_fraction > 0.0 ? kStates | kRotorDrop | kLosses | kEnergy
                                                                    : 0u;
  }
  std::vector<Parameter> parameters() const override {
    return {{"bar_height_m", "m", config_.bar_height_m},
            {"resistivity_ohm_m", "ohm m", config_.resistivity_ohm_m},
            {"bar_fraction", "1", config_.bar_fraction}};
  }
  double rotor_leakage_H(double R_r_nominal) const override {
    return config_.bar_fraction * R_r_nominal * tau_s_ / 3.0;
  }
  double fastest_rate_per_s() const override;

  std::size_t states() const override { return hooks() ? 2 * kLayers : 0; }
  void initial(double* own) const override;
  void rotor_drop(const Conditions& at, const double* own, RotorDrop& drop) const override;
  void derivatives(const Conditions& at, const double* own, double* d_own) const override;
  void losses(const Conditions& at, const double* own, Losses& heat) const override;
  void energy(const Conditions& at, const double* own, double& stored_J) const override;

 private:
  using Complex = std::complex<double>;
  static constexpr double kMu0 = 1.25663706212e-6;                            // Vs/(Am)
  static constexpr std::array<double, kLayers> kSeries{5.0, 9.0, 13.0, 5.0};  // of R, after each layer
  static Complex layer(const double* own, int k) { return {own[2 * k], own[2 * k + 1]}; }
  static double inductance(int k) { return 1.0 / (4.0 * k + 3.0); }  // of R tau, k from 0
  double bar_ohm(const Conditions& at) const { return config_.bar_fraction * at.R.R_r; }

  Config config_;
  double tau_s_;
};

}  // namespace imrig::plant
