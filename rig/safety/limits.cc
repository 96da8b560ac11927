#include "rig/safety/limits.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "rig/base/space_vector.h"

namespace imrig {

using imrig_msg::samples_t;

namespace {

constexpr std::int64_t kSpeedWindow_ns = 4'000'000;
constexpr std::int64_t kThermocoupleGone_ns = 1'000'000'000;

void current_of(const samples_t& samples, BlockExtremes& out) {
  for (std::size_t k = 0; k < samples.i_a.size(); ++k) {
    const int a = samples.i_a[k], b = samples.i_b[k], c = samples.i_c[k];
    const int largest = std::max({std::abs(a), std::abs(b), std::abs(c)});
    if (samples.full_scale_counts > 0 && largest >= samples.full_scale_counts) out.current_clipped = true;
    const double current_A =
        std::abs(space_vector(a, b, c)) * static_cast<double>(samples.current_A_per_count);
    if (current_A < out.current_A) continue;
    out.current_A = current_A;
    out.current_index = samples.first_index + static_cast<std::int64_t>(k);
  }
}

// Counts wrap at 2^32; their difference does not, as long as it is below 2^31.
std::int32_t counts_between(std::int32_t from, std::int32_t to) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(to) - static_cast<std::uint32_t>(from));
}

}  // namespace

BlockExtremes LimitMonitor::check(const samples_t& samples) {
  if (samples.boot_id != boot_id_) *this = LimitMonitor(limits_);
  boot_id_ = samples.boot_id;
  BlockExtremes out;
  current_of(samples, out);
  speed_of(samples, out);
  out.stator_C = static_cast<double>(samples.stator_C);
  const bool hot = out.stator_C > limits_.stator_C || thermocouple_gone(samples);
  if (!(out.current_A <= limits_.current_A) || out.current_clipped) {
    out.trip = Trip::kOverCurrent;
  } else if (std::abs(out.speed_rpm) > limits_.speed_rpm) {
    out.trip = Trip::kOverSpeed;
  } else if (hot) {
    out.trip = Trip::kOverTemperature;
  }
  return out;
}

void LimitMonitor::speed_of(const samples_t& samples, BlockExtremes& out) {
  bool measured = false;
  for (std::size_t k = 0; k < samples.encoder.size() && samples.encoder_counts_per_rev > 0; ++k) {
    const std::int64_t index = samples.first_index + static_cast<std::int64_t>(k);
    const std::int64_t elapsed_ns = (index - anchor_index_) * samples.sample_time_ns;
    if (anchored_ && elapsed_ns < kSpeedWindow_ns && elapsed_ns >= 0) continue;
    if (anchored_ && elapsed_ns > 0) {
      const double turns = static_cast<double>(counts_between(anchor_encoder_, samples.encoder[k])) /
                           samples.encoder_counts_per_rev;
      speed_rpm_ = turns / (static_cast<double>(elapsed_ns) * 1e-9) * 60.0;
      if (!measured || std::abs(speed_rpm_) > std::abs(out.speed_rpm)) out.speed_rpm = speed_rpm_;
      measured = true;
    }
    anchored_ = true;
    anchor_index_ = index;
    anchor_encoder_ = samples.encoder[k];
  }
  if (!measured) out.speed_rpm = speed_rpm_;
}

bool LimitMonitor::thermocouple_gone(const samples_t& samples) {
  const std::int64_t end = samples.first_index + static_cast<std::int64_t>(samples.i_a.size());
  if (std::isfinite(samples.stator_C)) {
    thermocouple_seen_ = true;
    thermocouple_index_ = end;
  }
  return thermocouple_seen_ && (end - thermocouple_index_) * samples.sample_time_ns >= kThermocoupleGone_ns;
}

}  // namespace imrig
