#pragma once
// Dead time and device drop: each phase loses a voltage against its current.
//   v = v_given - (2/3) sum a^x drop s(i_x / width),   s(u) = u / (1 + |u|^n)^(1/n)
// Only where the given voltage is the command, not the terminals'. The sign is softened over `width`, since
// the current ripple and the devices' own drop do so (Jeong and Park 1991). How it softens depends on the
// inverter: sharpness n = 2 in the plain form, near tanh at 2.7, clipped straight lines as n grows.
// The mean of a sign over a sample time h is soft over what the current crosses in it: width^2 + (w |i|
// h/2)^2.
// The sign is the measured current's where there is one: a simulated one that is off switches at the wrong
// instant, and a sharp sign of it is stiffer than any step of the simulation. But near zero the current is
// what the sign makes of it, and noise decides the measured one's: the richest form mixes by_model of the
// simulated current in.

#include <array>
#include <cmath>

#include "estimators/model/base_machine.h"
#include "estimators/model/effects/effect.h"

namespace imrig::est {

template <class T>
class InverterDeadTime : public EffectLaw<T> {
 public:
  static constexpr double kWidths[] = {0.1, 0.3, 1.0};
  static constexpr EffectParameter kShared[] = {
      {"drop_V", "V", Role::kAmplitude, 0.0, -2.0, 100.0, 0.1},
      {"width_A", "A", Role::kShape, 0.3, 1e-3, 100.0, 0.1, kWidths},
      {"sharpness", "1", Role::kShape, 2.0, 1.0, 12.0, 0.5},
      {"by_model", "1", Role::kShape, 0.0, 0.0, 1.0, 0.2}};
  static constexpr std::size_t kForm0[] = {0, 1};
  static constexpr std::size_t kForm1[] = {0, 1, 2};
  static constexpr std::size_t kForm2[] = {0, 1, 2, 3};
  static constexpr EffectForm kForms[] = {{"drop", kForm0, false, false},
                                          {"drop, its own sharpness", kForm1, false, true},
                                          {"drop, also by the model's current", kForm2, false, true}};
  static constexpr EffectInfo kInfo = {
      "inverter_dead_time",
      "The inverter loses a voltage against the sign of each phase current: dead time and device drop",
      "v = v_given - drop sign(i) in each phase",
      "Jeong and Park 1991, IEEE Trans. Industrial Electronics",
      "current sweep at DC or low frequency",
      Needs::kSeries,
      kForms,
      kShared};

  InverterDeadTime(const T* p, const T*) : p_(p), active_(live(p, 1)) {}

  void voltage(Cx<T>& v, const Cx<T>& i_s, const Instant& at) const {
    using std::sqrt;
    if (!active_) return;
    const Cx<T> turn(T(at.turn.real()), T(at.turn.imag()));
    const Cx<T> measured(T(at.current.real()), T(at.current.imag()));
    const Cx<T> i = (at.has_current ? measured + scaled(p_[3], i_s - measured) : i_s) * turn;
    const std::array<T, 3> phases{i.re, kHalfRoot3 * i.im - 0.5 * i.re, -(kHalfRoot3 * i.im) - 0.5 * i.re};
    const double crossed = 0.5 * at.w_k * at.sample_time_s;
    const T width = sqrt(p_[1] * p_[1] + crossed * crossed * (i.re * i.re + i.im * i.im));
    std::array<T, 3> signs;
    for (std::size_t x = 0; x < 3; ++x) signs[x] = soft_sign(phases[x] / width, p_[2]);
    const Cx<T> loss((2.0 * signs[0] - signs[1] - signs[2]) * (1.0 / 3.0),
                     (signs[1] - signs[2]) * (kHalfRoot3 / 1.5));
    v = v - scaled(p_[0], loss * conj(turn));
  }

 private:
  static T soft_sign(const T& u, const T& n) {
    using std::exp;
    using std::log;
    const T size = 0.5 * log(u * u + kZero);  // of |u|
    return size > 0.0 ? (u < 0.0 ? T(-1.0) : T(1.0)) * exp(-log(1.0 + exp(-n * size)) / n)
                      : u * exp(-log(1.0 + exp(n * size)) / n);
  }

  static constexpr double kZero = 1e-24;
  static constexpr double kHalfRoot3 = 0.86602540378443865;
  const T* p_;
  bool active_;
};

}  // namespace imrig::est
