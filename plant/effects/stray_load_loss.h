#pragma once
// Additional load loss: what surface and tooth pulsation, slot harmonics and inter-bar paths burn under load,
// taken from the shaft as a braking torque:
//   P = P_ref g (|w|/w_ref)^p,   T = P/w, smooth through rest: T = (P_ref/w_ref) g (|w|/w_ref)^(p-1)
//   w/sqrt(w^2 + w_0^2), g = |i_s|^2/i_ref^2 (basis "current") or (T_gap/T_ref)^2 (basis "torque", IEC
//   60034-2-1).
// It always brakes; its power is counted as stray_W. At standstill it vanishes (p > 1), a locked rotor's
// stray loss is not covered. Sources: Modelica Standard Library,
// Electrical.Machines.Losses.InductionMachines.StrayLoad (equivalent braking torque, current squared, a power
// of the speed); IEC 60034-2-1 (regression on the torque squared).

#include <cmath>

#include "plant/effects/effect.h"
#include "plant/effects/power.h"
#include "rig/base/space_vector.h"

namespace imrig::plant {

class StrayLoadLoss final : public Effect {
 public:
  enum class Basis { kCurrent, kTorque };
  struct Config {
    double loss_W = 0.0;  // P_ref
    Basis basis = Basis::kCurrent;
    double rated_A = 20.0;  // peak of the phase current, or
    double rated_Nm = 20.0;
    double rated_rpm = 1750.0;
    double exponent = 2.0;  // p, of the speed
  };

  explicit StrayLoadLoss(const Config& config)
      : config_(config),
        per_rated_(1.0 / rad_s_of_rpm(config.rated_rpm)),
        factor_(config.loss_W * per_rated_ / (reference() * reference())),
        of_speed_(config.exponent - 1.0) {}
  std::string name() const override { return "stray_load_loss"; }
  unsigned hooks() const override { return config_.loss_W > 0.0 ? kDrag | kLosses : 0u; }
  std::vector<Parameter> parameters() const override {
    const bool current = config_.basis == Basis::kCurrent;
    return {{"loss_W", "W", config_.loss_W},
            {current ? "rated_A" : "rated_Nm", current ? "A" : "Nm", reference()},
            {"rated_rpm", "rpm", config_.rated_rpm},
            {"exponent", "1", config_.exponent}};
  }
  double drag_Nm(const Conditions& at, const double* /*own*/) const override {
    return torque(at);
  }
  // The core has counted it as friction.
  void losses(const Conditions& at, const double* /*own*/, Losses& heat) const override {
    const double W = torque(at) * at.w_mech;
    heat.stray_W += W;
    heat.friction_W -= W;
  }

 private:
  static constexpr double kSmooth_rad_s = 0.2;  // w_0
  double reference() const { return config_.basis == Basis::kCurrent ? config_.rated_A : config_.rated_Nm; }
  double torque(const Conditions& at) const {
    const double load = config_.basis == Basis::kCurrent ? std::norm(at.i.s) : at.torque_Nm * at.torque_Nm;
    const double w = at.w_mech;
    return factor_ * load * of_speed_(std::abs(w) * per_rated_) * w /
           std::sqrt(w * w + kSmooth_rad_s * kSmooth_rad_s);
  }

  Config config_;
  double per_rated_, factor_;  // 1/w_ref; P_ref/(w_ref reference^2)
  Power of_speed_;
};

}  // namespace imrig::plant
