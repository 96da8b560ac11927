#pragma once
// Iron loss of the magnetizing flux, hysteresis and eddy:
//   P = P_h (f/f_0) (psi/psi_0)^a + P_e (f/f_0)^2 (psi/psi_0)^2,   2 pi f = |d psi/dt| / |psi|,
// as a conductance across the rotor's flux linkage, P = (3/2) G e^2, e = |d psi_r/dt|, w_0 = 2 pi f_0:
//   G_e = P_e / (1.5 w_0^2 psi_0^2),   G_h = P_h |psi|^(a-1) / (1.5 w_0 psi_0^a sqrt(q + e_0^2)).
// q is e^2 as it was over the last milliseconds (own state, tau dq/dt = e^2 - q), so that an alternating flux
// burns by its rms as well. Below e_0 = 1 V hysteresis goes over into a conductance, which keeps it smooth:
// its power is never negative and vanishes with e. Assumes one frequency at a time; minor loops of the
// switching ripple are not counted. Source: Bertotti, Hysteresis in Magnetism, 1998, chapter 12 (Steinmetz
// 1892 for the exponent).

#include <algorithm>
#include <cmath>
#include <numbers>

#include "plant/effects/effect.h"
#include "plant/effects/power.h"

namespace imrig::plant {

class IronLoss final : public Effect {
 public:
  struct Config {
    double hysteresis_W = 0.0, eddy_W = 0.0;  // at the rated point
    double rated_psi_Wb = 0.45;               // peak rotor flux linkage, T circuit
    double rated_f_Hz = 60.0;
    double exponent = 2.0;  // a
    double memory_s = 0.002;
  };

  explicit IronLoss(const Config& config) : config_(config), of_flux_(config.exponent - 1.0) {
    const double w_0 = 2.0 * std::numbers::pi * config.rated_f_Hz, psi_0 = config.rated_psi_Wb;
    eddy_S_ = config.eddy_W / (1.5 * w_0 * w_0 * psi_0 * psi_0);
    hysteresis_A_ = config.hysteresis_W / (1.5 * w_0 * psi_0);
  }
  std::string name() const override { return "iron_loss"; }
  unsigned hooks() const override {
    if (config_.hysteresis_W > 0.0) return kResistances | kStates;
    return config_.eddy_W > 0.0 ? kResistances : 0u;
  }
  std::vector<Parameter> parameters() const override {
    return {{"hysteresis_W", "W", config_.hysteresis_W},  {"eddy_W", "W", config_.eddy_W},
            {"rated_psi_Wb", "Wb", config_.rated_psi_Wb}, {"rated_f_Hz", "Hz", config_.rated_f_Hz},
            {"exponent", "1", config_.exponent},          {"memory_s", "s", config_.memory_s}};
  }
  double fastest_rate_per_s() const override { return 1.0 / config_.memory_s; }

  std::size_t states() const override { return hooks() & kStates ? 1 : 0; }
  void initial(double* own) const override {
    if (states()) own[0] = 0.0;
  }
  void resistances(const Conditions& at, const double* own, Resistances& R) const override {
    R.G_iron += eddy_S_;
    if (!states()) return;
    const double psi = std::sqrt(std::norm(at.psi_r)) / config_.rated_psi_Wb;
    const double e = std::sqrt(std::max(own[0], 0.0) + kSmooth_V * kSmooth_V);
    R.G_iron += hysteresis_A_ * of_flux_(psi) / e;
  }
  void derivatives(const Conditions& at, const double* own, double* d_own) const override {
    if (states()) d_own[0] = (std::norm(at.dpsi_r) - own[0]) / config_.memory_s;
  }

 private:
  static constexpr double kSmooth_V = 1.0;  // e_0

  Config config_;
  Power of_flux_;
  double eddy_S_, hysteresis_A_;
};

}  // namespace imrig::plant
