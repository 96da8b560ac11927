#pragma once
// Speed of the shaft at every sample from encoder counts, and whether it can be believed.
//   speed = (c_k - c_{k-W}) 2 pi/(counts_per_rev W h),  W = 256 samples
// Counts of one slot of kSlot samples may change from slot to slot by what inertia allows: kMostStep counts and 2 %.
// A larger change is a dropout (cable, missed or extra counts): the speed is unknown until slots agree with the
// last good one again, the allowance growing by kRegain counts a slot, and for W samples more. A fault that lasts
// longer than that looks like a real change; the rotor observer's plausibility is the second net.

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <numbers>

namespace imrig::est {

class ShaftWatch {
 public:
  static constexpr std::int64_t kWindow = 256, kSlot = 16;
  static constexpr double kMostStep = 6.0, kRegain = 2.0;

  void configure(int counts_per_rev, double sample_time_s) {
    counts_per_rev_ = counts_per_rev;
    rad_s_per_count_ = counts_per_rev > 0 ? 2.0 * std::numbers::pi /
                                                (counts_per_rev * sample_time_s * static_cast<double>(kWindow))
                                          : 0.0;
    restart();
  }
  void restart() {
    seen_ = since_good_ = 0;
    slots_ = 0;
    lost_ = false;
  }
  // Mechanical rad/s; NaN where it is not known.
  double take(std::int32_t encoder) {
    if (counts_per_rev_ < 1) return kNone;
    if (seen_ == 0) total_ = 0;
    if (seen_ > 0)
      total_ += static_cast<std::int32_t>(static_cast<std::uint32_t>(encoder) - static_cast<std::uint32_t>(last_));
    last_ = encoder;
    if (seen_ % kSlot == 0) judge();
    std::int64_t& old = ring_[static_cast<std::size_t>(seen_ % kWindow)];
    const std::int64_t apart = total_ - old;
    old = total_;
    const bool known = seen_ >= kWindow && since_good_ >= kWindow;
    ++seen_;
    ++since_good_;
    return known ? static_cast<double>(apart) * rad_s_per_count_ : kNone;
  }
  // No count in the last window.
  bool at_rest() const { return seen_ > kWindow && !lost_ && still_ >= kWindow / kSlot; }
  std::int64_t dropouts() const { return dropouts_; }

 private:
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  void judge() {
    const auto slot = static_cast<double>(total_ - slot_begin_);
    slot_begin_ = total_;
    if (++slots_ < 3) {  // the first slot holds one sample less
      good_ = slot;
      still_ = 0;
      return;
    }
    still_ = slot == 0.0 ? still_ + 1 : 0;
    const double allowed = kMostStep + 0.02 * std::abs(good_) + (lost_ ? kRegain * static_cast<double>(lost_slots_) : 0.0);
    if (std::abs(slot - good_) <= allowed) {
      if (lost_) since_good_ = 0;
      lost_ = false;
      good_ = slot;
      return;
    }
    if (!lost_) {
      ++dropouts_;
      lost_slots_ = 0;
    }
    lost_ = true;
    ++lost_slots_;
    since_good_ = 0;
  }

  int counts_per_rev_ = 0;
  double rad_s_per_count_ = 0.0;
  std::array<std::int64_t, kWindow> ring_{};
  std::int64_t total_ = 0, slot_begin_ = 0, seen_ = 0, since_good_ = 0, slots_ = 0, lost_slots_ = 0, still_ = 0;
  std::int64_t dropouts_ = 0;
  std::int32_t last_ = 0;
  double good_ = 0.0;
  bool lost_ = false;
};

}  // namespace imrig::est
