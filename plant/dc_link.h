#pragma once
// The DC link behind the inverter: a rectifier with e(t) = V_0 + V_ripple cos(2 pi f t) behind R, and a
// capacitor C that the inverter loads with the power P:
//   C dv/dt = max(0, (e - v)/R) - P/v.
// Over a step e and P/v are held and the rest is solved exactly. Without a capacitor v is the root of
// v = e - R P/v (a source that also takes current back), without R v = e. Power that flows back charges the
// capacitor until the brake chopper holds it. The drop of the switches is not charged to the link.
// Source: Mohan, Undeland, Robbins, Power Electronics, chapter 5.

#include <algorithm>
#include <cmath>

#include "plant/plant_config.h"
#include "rig/base/space_vector.h"

namespace imrig::plant {

class DcLink {
 public:
  explicit DcLink(const InverterConfig& config) : c_(config), v_(config.dc_link_V) {}

  bool stiff() const { return c_.source_ohm == 0.0 && c_.ripple_V == 0.0; }
  double voltage_V() const { return v_; }

  // Voltage for the step from t_s to t_s + h_s, while the inverter took the power load_W over the last one.
  void step(double t_s, double h_s, double load_W) {
    if (stiff()) return;
    const double e = c_.dc_link_V + c_.ripple_V * std::cos(2.0 * kPi * c_.ripple_Hz * t_s);
    v_ = c_.source_ohm == 0.0    ? e
         : c_.capacitor_F == 0.0 ? without_capacitor(e, load_W)
                                 : charged(e, h_s, load_W);
    if (c_.brake_V > 0.0) v_ = std::min(v_, c_.brake_V);
    v_ = std::max(v_, 0.01 * c_.dc_link_V);
  }

 private:
  double without_capacitor(double e, double load_W) const {
    const double square = e * e - 4.0 * c_.source_ohm * load_W;
    return square > 0.0 ? 0.5 * (e + std::sqrt(square)) : 0.5 * e;  // beyond: what the source gives at most
  }
  double charged(double e, double h_s, double load_W) const {
    const double load_A = load_W / v_, rest = e - c_.source_ohm * load_A;
    const double fed = rest + (v_ - rest) * std::exp(-h_s / (c_.source_ohm * c_.capacitor_F));
    return fed <= e ? fed : v_ - h_s * load_A / c_.capacitor_F;  // above e the rectifier blocks
  }

  InverterConfig c_;
  double v_;
};

}  // namespace imrig::plant
