#pragma once
// A rotor out of its centre: the gap is g (1 - e_s cos x - e_d cos(x - theta)), static (fixed to the stator)
// and dynamic (turning with the shaft) eccentricity as shares of the gap. The mean permeance of the gap is
//   P(theta) = P_0/sqrt(1 - e^2),   e^2 = e_s^2 + e_d^2 + 2 e_s e_d cos theta,
// so the gap's part of the magnetizing current becomes sqrt(1 - e^2) of itself: constant where only one of
// the two is there, and with both modulated at the shaft's frequency: lines at f +- f_r. As an energy of the
// gap beside the linear circuit's,
//   W = (3/4) q(theta) |psi|^2,   q = (sqrt(1 - e^2) - 1)/L_m,   psi = (psi_s + psi_r)/2:
//   i_s += q psi/2,   i_r += q psi/2,   T = -(3/4) q'(theta) |psi|^2,
// so nothing is made or lost. psi stands for the gap's flux linkage: equal leakages on both sides, first
// order in L_leakage/L_m. Source: the mean of
// 1/(1 - e cos x); Nandi, Toliyat, Li, Condition monitoring and fault diagnosis of electrical motors: a
// review, IEEE Trans. Energy Conversion 20(4), 2005 (mixed eccentricity gives f +- k f_r).

#include <algorithm>
#include <cmath>

#include "plant/effects/effect.h"

namespace imrig::plant {

class Eccentricity final : public Effect {
 public:
  struct Config {
    double static_share = 0.0, dynamic_share = 0.0;  // e_s, e_d; their sum below 1
  };

  explicit Eccentricity(const Config& config) : config_(config) {}
  std::string name() const override { return "eccentricity"; }
  unsigned hooks() const override {
    const bool acts = config_.static_share != 0.0 || config_.dynamic_share != 0.0;
    return acts ? kCurrents | kDrag | kLosses | kEnergy : 0u;
  }
  std::vector<Parameter> parameters() const override {
    return {{"static_share", "1", config_.static_share}, {"dynamic_share", "1", config_.dynamic_share}};
  }
  // q and dq/dtheta, 1/H
  double q(double theta, double L_m) const { return (root(theta) - 1.0) / L_m; }
  double slope(double theta, double L_m) const {
    return config_.static_share * config_.dynamic_share * std::sin(theta) / (root(theta) * L_m);
  }
  void currents(const Conditions& at, const double* /*own*/, Currents& i) const override {
    const std::complex<double> extra = 0.5 * q(at.angle, at.L_m) * gap(at);
    i.s += extra, i.r += extra;
  }
  // Its own torque; the hook takes what brakes. Over a turn it gives back what it takes.
  double drag_Nm(const Conditions& at, const double* /*own*/) const override {
    return 0.75 * slope(at.angle, at.L_m) * std::norm(gap(at));
  }
  void losses(const Conditions& at, const double* /*own*/, Losses& heat) const override {
    heat.friction_W -= 0.75 * slope(at.angle, at.L_m) * std::norm(gap(at)) * at.w_mech;
  }
  void energy(const Conditions& at, const double* /*own*/, double& stored_J) const override {
    stored_J += 0.75 * q(at.angle, at.L_m) * std::norm(gap(at));
  }

 private:
  double root(double theta) const {
    const double a = config_.static_share, b = config_.dynamic_share;
    return std::sqrt(std::max(1e-6, 1.0 - a * a - b * b - 2.0 * a * b * std::cos(theta)));
  }
  static std::complex<double> gap(const Conditions& at) { return 0.5 * (at.psi_s + at.psi_r); }

  Config config_;
};

}  // namespace imrig::plant
