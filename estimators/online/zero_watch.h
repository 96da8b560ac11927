#pragma once
// Zeros of the sensors, in counts: their mean while the gates are off and the shaft rests. Rotor flux that is left
// from before dies away in the voltages, so a stretch counts kSettle_s after both hold, and from kLeast_s on its
// mean replaces what was known; while nothing is known, a short stretch serves for the time being. Without any, the
// direct part of the phasor fit of a window (OperatingPoint) does, where the motor runs.

#include <array>
#include <cstdint>

#include "estimators/online/operating_point.h"

namespace imrig::est {

class ZeroWatch {
 public:
  static constexpr double kSettle_s = 2.0, kHasty_s = 0.1, kLeast_s = 0.1;
  using Counts = std::array<double, 6>;  // i_a, i_b, i_c, v_a, v_b, v_c

  void restart_stretch() { off_samples_ = 0; }
  void take(const SampleBlock& b, double sample_time_s);
  const Counts& counts() const { return zero_; }
  bool measured() const { return measured_; }

 private:
  Counts zero_{}, sum_{};
  std::int64_t off_samples_ = 0, counted_ = 0;
  std::int32_t encoder_ = 0;
  bool measured_ = false, settled_ = false;
};

inline void ZeroWatch::take(const SampleBlock& b, double sample_time_s) {
  if (b.gates_on) return restart_stretch();
  const std::array<std::span<const std::int16_t>, 6> all{b.i_a, b.i_b, b.i_c, b.v_a, b.v_b, b.v_c};
  const auto samples = [&](double s) { return static_cast<std::int64_t>(s / sample_time_s); };
  const std::int64_t settle = samples(kSettle_s), hasty = samples(kHasty_s), least = samples(kLeast_s);
  for (std::size_t k = 0; k < b.size(); ++k) {
    if (off_samples_ > 0 && b.encoder[k] != encoder_) off_samples_ = 0;
    encoder_ = b.encoder[k];
    ++off_samples_;
    if (off_samples_ == hasty || off_samples_ == settle) {
      sum_ = {};
      counted_ = 0;
    }
    if (off_samples_ < hasty || (settled_ && off_samples_ < settle)) continue;
    for (std::size_t c = 0; c < all.size(); ++c) sum_[c] += static_cast<double>(all[c][k]);
    if (++counted_ < least) continue;
    measured_ = true;
    settled_ = settled_ || off_samples_ >= settle;
    for (std::size_t c = 0; c < all.size(); ++c) zero_[c] = sum_[c] / static_cast<double>(counted_);
  }
}

}  // namespace imrig::est
