#pragma once
// Two-level inverter whose every switching instant is followed. The command is latched where a carrier cycle
// T begins and becomes three duties with the min-max zero sequence (the mean of the largest and the smallest
// phase voltage is taken off, which is symmetric space-vector modulation); leg k is high over
//   T (1 - d_k)/2 <= t < T (1 + d_k)/2,   d_k = 1/2 + u_k/V_dc within [0, 1].
// Beyond the hexagon the duties clip: the vector becomes the hexagon's nearest point. Dead time: with both
// switches off, a current into the motor runs through the lower diode, one out of it through the upper; what
// the current's sign is where the gap begins holds for the gap. A command that returns within the gap makes
// no pulse. Time runs only through pass(); act() does what is due.
// Source: Holmes and Lipo, Pulse Width Modulation for Power Converters, 2003, chapters 5 and 6.

#include <algorithm>
#include <array>
#include <complex>
#include <limits>

#include "plant/inverter.h"

namespace imrig::plant {

class SwitchingInverter {
 public:
  SwitchingInverter(double cycle_s, double dead_time_s) : cycle_s_(cycle_s), dead_s_(dead_time_s) {}

  // The gates open; the next act() latches at once.
  void release() { running_ = false; }
  // Puts the time within the cycle on its exact value (the clock counts samples, not stretches).
  void anchor(double into_s) {
    into_s_ = running_ && into_s_ - into_s > 0.5 * cycle_s_ ? into_s + cycle_s_ : into_s;
  }

  // Does what is due now: latches asked_V at the start of a cycle, moves legs. i: phase currents.
  void act(SpaceVector asked_V, double dc_link_V, const std::array<double, 3>& i) {
    if (cycle_s_ - into_s_ <= kNow_s) into_s_ = std::max(0.0, into_s_ - cycle_s_);
    const bool begins = into_s_ <= kNow_s;
    if ((begins && !latched_) || !running_) duty_ = duties(asked_V, dc_link_V);
    latched_ = begins;
    for (std::size_t k = 0; k < 3; ++k) move(k, i[k]);
    running_ = true;
  }

  double until_next_s() const {
    double next = cycle_s_;
    for (std::size_t k = 0; k < 3; ++k) {
      for (const double edge : {rise(k), fall(k)}) {
        if (edge > into_s_ + kNow_s) next = std::min(next, edge);
      }
    }
    next -= into_s_;
    for (const double left : gap_left_s_) {
      if (left > 0.0) next = std::min(next, left);
    }
    return next;
  }

  void pass(double time_s) {
    into_s_ += time_s;
    if (into_s_ > kNow_s) latched_ = false;
    for (double& left : gap_left_s_) left -= time_s;
  }

  // Vector of the poles; upper switches' pattern is bits 0 to 2.
  SpaceVector voltage(double dc_link_V) const {
    return space_vector(high_[0] ? dc_link_V : 0.0, high_[1] ? dc_link_V : 0.0, high_[2] ? dc_link_V : 0.0);
  }

 private:
  static constexpr double kNow_s = 1e-13;

  double rise(std::size_t k) const { return 0.5 * cycle_s_ * (1.0 - duty_[k]); }
  double fall(std::size_t k) const { return 0.5 * cycle_s_ * (1.0 + duty_[k]); }

  void move(std::size_t k, double i) {
    const double now = into_s_ + kNow_s;
    const bool wanted = duty_[k] >= 1.0 || (duty_[k] > 0.0 && now >= rise(k) && now < fall(k));
    if (!running_ || dead_s_ <= 0.0) {
      gated_[k] = high_[k] = wanted;
      gap_left_s_[k] = 0.0;
    } else if (wanted != gated_[k]) {
      gated_[k] = wanted;
      high_[k] = i <= 0.0;
      gap_left_s_[k] = high_[k] == wanted ? 0.0 : dead_s_;
    } else if (gap_left_s_[k] <= kNow_s) {
      high_[k] = gated_[k];
      gap_left_s_[k] = 0.0;
    }
  }

  double cycle_s_, dead_s_;
  bool running_ = false, latched_ = false;
  double into_s_ = 0.0;
  std::array<double, 3> duty_{}, gap_left_s_{};
  std::array<bool, 3> gated_{}, high_{};
};

}  // namespace imrig::plant
