#pragma once
// What a running estimate of R_r is good for: R_r(w_s, T) = R_1(T) + k_6 |w_s| (Proca and Keyhani 2002,
// equation 13; w_s the slip frequency, electrical rad/s). Each estimate renews R_1, the part that follows the
// cage's temperature, and so tells R_r at every other slip. Between estimates R_1 moves by the share 1 -
// exp(-dt/settle_s) towards the new one.

#include <cmath>
#include <optional>

namespace imrig::est {

class RotorTracker {
 public:
  // settle_s 0: the newest estimate alone.
  explicit RotorTracker(double k_6_ohm_s, double settle_s = 0.0) : k_6_(k_6_ohm_s), settle_s_(settle_s) {}

  void take(double R_r_ohm, double w_s_rad_s, double dt_s) {
    const double now = R_r_ohm - k_6_ * std::abs(w_s_rad_s);
    const double share = known_ && settle_s_ > 0.0 ? -std::expm1(-dt_s / settle_s_) : 1.0;
    R_1_ += share * (now - R_1_);
    known_ = true;
  }
  std::optional<double> R_1_ohm() const { return known_ ? std::optional(R_1_) : std::nullopt; }
  // At another slip frequency.
  std::optional<double> R_r_ohm(double w_s_rad_s) const {
    return known_ ? std::optional(R_1_ + k_6_ * std::abs(w_s_rad_s)) : std::nullopt;
  }

 private:
  double k_6_, settle_s_;
  double R_1_ = 0.0;
  bool known_ = false;
};

}  // namespace imrig::est
