#pragma once
// Is the operating point steady? Between consecutive, adjoining windows each of V, I, f and slip may change
// by
//   |x_2 - x_1| <= floor + 4 sqrt(sigma_1^2 + sigma_2^2)
// with sigma as measured in the windows, and the floors below. Steady after kSteadyChanges such changes in a
// row. A first-order settling with time constant T that changes by d over a window of length W is still
// d/(e^{W/T} - 1) away from its end: for T = W that is 0.6 d.

#include <algorithm>
#include <cmath>

#include "estimators/online/operating_point.h"

namespace imrig::est {

class SteadyCriterion {
 public:
  static constexpr double kVoltage = 1e-3;  // relative floors
  static constexpr double kCurrent = 2e-3;
  static constexpr double kFrequency = 1e-4;
  static constexpr double kSlip = 5e-3;
  static constexpr double kSlipLeast = 5e-5;  // absolute, near no load
  static constexpr double kSigmas = 4.0;
  static constexpr int kSteadyChanges = 2;
  static constexpr int kMovedV = 1, kMovedI = 2, kMovedF = 4, kMovedSlip = 8;  // as in motor_estimate_t

  // Takes the next window, says whether the point is steady.
  bool take(const OperatingPoint& now) {
    const bool adjoins =
        last_.valid && now.valid && now.boot_id == last_.boot_id && now.first_index == last_.last_index + 1;
    moved_ = adjoins ? changes(last_, now) : 0;
    calm_ = adjoins && moved_ == 0 ? std::min(calm_ + 1, kSteadyChanges) : 0;
    last_ = now;
    return calm_ >= kSteadyChanges;
  }
  // Which quantities changed too much between the last two windows; 0 also where these do not adjoin.
  int moved() const { return moved_; }

 private:
  static bool within(double a, double b, double floor, double sigma_a, double sigma_b) {
    return std::abs(b - a) <= floor + kSigmas * std::hypot(sigma_a, sigma_b);
  }
  static int changes(const OperatingPoint& a, const OperatingPoint& b) {
    const bool slip =
        std::isnan(b.slip) ||
        within(a.slip, b.slip, std::max(kSlip * std::abs(b.slip), kSlipLeast), a.sigma_slip, b.sigma_slip);
    const bool V = within(a.voltage_V, b.voltage_V, kVoltage * b.voltage_V, a.sigma_voltage_V, b.sigma_voltage_V);
    const bool I = within(a.current_A, b.current_A, kCurrent * b.current_A, a.sigma_current_A, b.sigma_current_A);
    const bool f = within(a.frequency_Hz, b.frequency_Hz, kFrequency * std::abs(b.frequency_Hz),
                          a.sigma_frequency_Hz, b.sigma_frequency_Hz);
    return (V ? 0 : kMovedV) | (I ? 0 : kMovedI) | (f ? 0 : kMovedF) | (slip ? 0 : kMovedSlip);
  }

  OperatingPoint last_;
  int calm_ = 0;
  int moved_ = 0;
};

}  // namespace imrig::est
