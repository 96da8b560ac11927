#pragma once
// Currents between the bars of a skewed, uninsulated cage shunt part of its skew leakage L_x with the
// resistance R_x of the iron between the bars:
//   Z_x(w_s) = j w_s L_x R_x/(R_x + j w_s L_x),
// which adds nothing at small slip frequency, L_x below R_x/L_x and R_x above it: rotor loss that grows with
// the square of the slip frequency at first. The current of L_x is the state (stator frame):
//   v = R_x (i_bar - i_x),   d i_x/dt = v/L_x + j n_p w i_x.
// L_x is a part of the machine's rotor leakage, which stays what it is at small slip frequency. Source:
// derived here, one loop of a skewed cage closed through the iron; that such currents blunt the signs of a
// broken bar: Gritli et al., Quantitative rotor broken bar evaluation in double squirrel cage induction
// machines, EVER 2013.

#include <complex>

#include "plant/effects/effect.h"

namespace imrig::plant {

class InterbarCurrent final : public Effect {
 public:
  struct Config {
    double inductance_H = 0.0;    // L_x, T circuit
    double resistance_ohm = 0.5;  // R_x
  };

  explicit InterbarCurrent(const Config& config) : config_(config) {}
  std::string name() const override { return "interbar_current"; }
  unsigned hooks() const override {
    return config_.inductance_H > 0.0 ? kStates | kRotorDrop | kLosses | kEnergy : 0u;
  }
  std::vector<Parameter> parameters() const override {
    return {{"inductance_H", "H", config_.inductance_H}, {"resistance_ohm", "ohm", config_.resistance_ohm}};
  }
  double fastest_rate_per_s() const override {
    return config_.inductance_H > 0.0 ? config_.resistance_ohm / config_.inductance_H : 0.0;
  }
  double rotor_leakage_H(double /*R_r_nominal*/) const override { return config_.inductance_H; }
  std::size_t states() const override { return 2; }
  void initial(double* own) const override { own[0] = own[1] = 0.0; }
  void rotor_drop(const Conditions& /*at*/, const double* own, RotorDrop& drop) const override {
    drop.R += config_.resistance_ohm;
    drop.v_0 -= config_.resistance_ohm * std::complex<double>(own[0], own[1]);
  }
  void derivatives(const Conditions& at, const double* own, double* d_own) const override {
    const double rate = config_.resistance_ohm / config_.inductance_H, w = at.n_p * at.w_mech;
    d_own[0] = rate * (at.i_bar.real() - own[0]) - w * own[1];
    d_own[1] = rate * (at.i_bar.imag() - own[1]) + w * own[0];
  }
  // The core counts R_x |i_bar|^2; it is R_x |i_bar - i_x|^2.
  void losses(const Conditions& at, const double* own, Losses& heat) const override {
    const std::complex<double> i_x(own[0], own[1]);
    heat.rotor_copper_W += 1.5 * config_.resistance_ohm * (std::norm(at.i_bar - i_x) - std::norm(at.i_bar));
  }
  void energy(const Conditions& /*at*/, const double* own, double& stored_J) const override {
    stored_J += 0.75 * config_.inductance_H * (own[0] * own[0] + own[1] * own[1]);
  }

 private:
  Config config_;
};

}  // namespace imrig::plant
