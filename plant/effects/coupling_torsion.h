#pragma once
// Motor and generator as two masses on a shaft that twists by phi:
//   T_shaft = k phi + c (w - w_g),   d phi/dt = w - w_g,   J_g dw_g/dt = T_shaft + T_generator,
// and the motor's J (mechanics.J_kgm2, then without the generator's) feels -T_shaft. Resonance of the free
// pair
//   w_0 = sqrt(k (1/J + 1/J_g)),   damping ratio = (c/2) sqrt((1/J + 1/J_g)/k).
// Friction brakes the motor's end. Source: Kundur, Power System Stability and Control, chapter 15.

#include <cmath>

#include "plant/effects/effect.h"

namespace imrig::plant {

class CouplingTorsion final : public Effect {
 public:
  struct Config {
    double stiffness_Nm = 0.0;  // k per rad; 0: rigid
    double damping_Nms = 0.0;   // c
    double generator_J_kgm2 = 0.02;
  };

  explicit CouplingTorsion(const Config& config) : config_(config) {}
  std::string name() const override { return "coupling_torsion"; }
  unsigned hooks() const override {
    return config_.stiffness_Nm > 0.0 ? kStates | kCoupling | kLosses | kEnergy : 0u;
  }
  std::vector<Parameter> parameters() const override {
    return {{"stiffness_Nm", "Nm/rad", config_.stiffness_Nm},
            {"damping_Nms", "Nm s/rad", config_.damping_Nms},
            {"generator_J_kgm2", "kg m^2", config_.generator_J_kgm2}};
  }
  // With the motor's end held; the free pair is faster by sqrt(1 + J_g/J).
  double fastest_rate_per_s() const override {
    if (config_.stiffness_Nm <= 0.0) return 0.0;
    return std::sqrt(config_.stiffness_Nm / config_.generator_J_kgm2) +
           config_.damping_Nms / config_.generator_J_kgm2;
  }
  std::size_t states() const override { return 2; }  // phi, w_g
  void initial(double* own) const override { own[0] = own[1] = 0.0; }
  void coupling(const Conditions& at, const double* own, Coupling& coupling) const override {
    coupling.rigid = false;
    coupling.w_generator = own[1];
    coupling.torque_on_motor_Nm = -shaft_Nm(at, own);
    coupling.heat_W = config_.damping_Nms * (at.w_mech - own[1]) * (at.w_mech - own[1]);
  }
  void derivatives(const Conditions& at, const double* own, double* d_own) const override {
    d_own[0] = at.w_mech - own[1];
    d_own[1] = (shaft_Nm(at, own) + at.generator_Nm) / config_.generator_J_kgm2;
  }
  void losses(const Conditions& at, const double* /*own*/, Losses& heat) const override {
    heat.friction_W += at.coupling.heat_W;
  }
  void energy(const Conditions& /*at*/, const double* own, double& stored_J) const override {
    stored_J +=
        0.5 * config_.stiffness_Nm * own[0] * own[0] + 0.5 * config_.generator_J_kgm2 * own[1] * own[1];
  }

 private:
  double shaft_Nm(const Conditions& at, const double* own) const {
    return config_.stiffness_Nm * own[0] + config_.damping_Nms * (at.w_mech - own[1]);
  }

  Config config_;
};

}  // namespace imrig::plant
