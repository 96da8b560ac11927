#include "rig/dyno/shaft_speed.h"

namespace imrig {

namespace {

constexpr double kStretch_s = 0.020;
constexpr std::int64_t kLatest_ns = std::int64_t{1} << 62;  // what comes off the wire must not overflow

}  // namespace

void ShaftSpeed::take(const imrig_msg::samples_t& samples) {
  if (samples.n < 1 || samples.sample_time_ns < 1 || samples.first_index < 0) return;
  if (samples.first_index > kLatest_ns / samples.sample_time_ns) return;
  if (!seen_ || samples.boot_id != boot_id_) {
    *this = ShaftSpeed();
    seen_ = true;
    boot_id_ = samples.boot_id;
    anchor_index_ = samples.first_index;
    anchor_count_ = samples.encoder.front();
  } else if (samples.first_index < next_index_) {
    return;
  }
  const std::int64_t last = samples.first_index + samples.n - 1;
  next_index_ = last + 1;
  const double sample_time_s = 1e-9 * static_cast<double>(samples.sample_time_ns);
  utime_ = last * samples.sample_time_ns / 1000;
  const double stretch_s = static_cast<double>(last - anchor_index_) * sample_time_s;
  if (stretch_s < kStretch_s || samples.encoder_counts_per_rev < 1) return;
  // Counts wrap at 2^32: the difference is taken modulo that.
  const auto counts = static_cast<std::int32_t>(static_cast<std::uint32_t>(samples.encoder.back()) -
                                                static_cast<std::uint32_t>(anchor_count_));
  rpm_ = 60.0 * counts / (samples.encoder_counts_per_rev * stretch_s);
  anchor_index_ = last;
  anchor_count_ = samples.encoder.back();
}

}  // namespace imrig
