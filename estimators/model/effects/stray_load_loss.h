#pragma once
// Stray load loss: torque that the rotor current costs beyond the circuit's own losses,
//   T = drag I^2 (|w_M| / w_0)^n sgn(w_M), so P = drag I^2 |w_M| (|w_M| / w_0)^n, w_0 = 157.08 rad/s (1500
//   rpm), I^2 = (1 - share) |i_r|^2 + share |i_s|^2, peak values.
// IEC 60034-2-1 fits it as P proportional to T^2 at one speed, which the rotor's current is; Modelica takes
// the stator's, which holds the magnetizing one. Surface and tooth pulsation grow with the frequency (n to 1
// and above), inter-bar currents little. Seen only where shaft torque or shaft power is measured.

#include <algorithm>
#include <cmath>

#include "estimators/model/base_machine.h"
#include "estimators/model/effects/effect.h"

namespace imrig::est {

template <class T>
class StrayLoadLoss : public EffectLaw<T> {
 public:
  static constexpr double kSpeeds[] = {0.0, 1.0, 2.0};
  static constexpr EffectParameter kShared[] = {
      {"drag_Nm_per_A2", "Nm/A^2", Role::kAmplitude, 0.0, 0.0, 10.0, 1e-4},
      {"speed_exponent", "1", Role::kShape, 0.0, 0.0, 3.0, 0.5, kSpeeds},
      {"stator_share", "1", Role::kShape, 0.0, 0.0, 1.0, 0.2}};
  static constexpr std::size_t kForm0[] = {0};
  static constexpr std::size_t kForm1[] = {0, 1};
  static constexpr std::size_t kForm2[] = {0, 1, 2};
  static constexpr EffectForm kForms[] = {{"drag", kForm0, false, false},
                                          {"drag, its own power of the speed", kForm1, false, true},
                                          {"drag, also by the stator's current", kForm2, false, true}};
  static constexpr EffectInfo kInfo = {
      "stray_load_loss",
      "Under load the machine loses more than its resistances, its iron and its bearings take",
      "T_lost = drag I^2 (|w|/w_0)^n",
      "IEC 60034-2-1 (additional load losses from P(T^2)); IEEE 112 method B",
      "temperature-corrected regression of the residual loss on T^2",
      Needs::kTorque,
      kForms,
      kShared};

  StrayLoadLoss(const T* p, const T*) : p_(p), active_(live(p, 1)) {}

  void lost_torque(T& torque, const T& w_M, const Cx<T>& i_r, const Cx<T>& i) const {
    using std::exp;
    if (!active_) return;
    const double w = value_of(w_M);
    const double sign = w > kRest_rad_s ? 1.0 : w < -kRest_rad_s ? -1.0 : w / kRest_rad_s;
    // Of the measured speed: an error of it moves so little of so small a loss.
    const double log_speed = std::log(std::max(std::abs(w), kRest_rad_s) / kReference_rad_s);
    const T square = norm(i_r) + p_[2] * (norm(i) - norm(i_r));
    torque = torque + p_[0] * sign * square * exp(p_[1] * log_speed);
  }

 private:
  static constexpr double kRest_rad_s = 0.1, kReference_rad_s = 157.07963267948966;
  const T* p_;
  bool active_;
};

}  // namespace imrig::est
