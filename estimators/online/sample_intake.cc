#include "estimators/online/sample_intake.h"

#include <algorithm>
#include <cmath>

#include "rig/base/space_vector.h"

namespace imrig::est {

void SampleIntake::take_channel(const SampleBlock& b) {
  if (b.boot_id != boot_id_ || b.current_A_per_count != current_scale_ || b.voltage_V_per_count != voltage_scale_) {
    zeros_ = {};
    suggested_ = false;
  }
  started_ = true;
  boot_id_ = b.boot_id;
  sample_time_ns_ = b.sample_time_ns;
  current_scale_ = b.current_A_per_count;
  voltage_scale_ = b.voltage_V_per_count;
  counts_per_rev_ = b.encoder_counts_per_rev;
  chunk_.sample_time_s = 1e-9 * static_cast<double>(b.sample_time_ns);
  chunk_.voltage_filter_s = b.voltage_filter_s;
  filter_ = MatchedFilter(chunk_.sample_time_s, b.voltage_filter_s);
  shaft_.configure(b.encoder_counts_per_rev, chunk_.sample_time_s);
}

const Chunk& SampleIntake::take(const SampleBlock& b) {
  chunk_.fresh = !started_ || !same_channel(b) || b.first_index != next_index_ || b.gates_on != chunk_.gates_on;
  if (!started_ || !same_channel(b)) take_channel(b);
  if (b.first_index != next_index_) {
    zeros_.restart_stretch();
    shaft_.restart();
  }
  if (chunk_.fresh) {
    filter_.restart();
    cold_ = static_cast<std::int64_t>(std::ceil(kForgotten * b.voltage_filter_s / chunk_.sample_time_s));
  }
  chunk_.first_index = b.first_index;
  chunk_.n = b.size();
  chunk_.gates_on = b.gates_on;
  chunk_.stator_C = b.stator_C;
  chunk_.cold = static_cast<std::size_t>(std::clamp<std::int64_t>(cold_, 0, static_cast<std::int64_t>(b.size())));
  zeros_.take(b, chunk_.sample_time_s);
  const ZeroWatch::Counts& z = zeros_.counts();
  std::complex<double> v_zero, i_zero;
  if (zeros_.measured()) {
    i_zero = current_scale_ * space_vector(z[0], z[1], z[2]);
    v_zero = voltage_scale_ * space_vector(z[3], z[4], z[5]);
  } else if (suggested_) {
    v_zero = v_zero_;
    i_zero = i_zero_;
  }
  for (std::size_t k = 0; k < b.size(); ++k) {
    chunk_.v[k] = voltage_scale_ * space_vector(b.v_a[k], b.v_b[k], b.v_c[k]) - v_zero;
    chunk_.i[k] = filter_.take(current_scale_ * space_vector(b.i_a[k], b.i_b[k], b.i_c[k]) - i_zero);
    chunk_.speed_rad_s[k] = shaft_.take(b.encoder[k]);
    chunk_.at_rest[k] = shaft_.at_rest();
  }
  cold_ -= static_cast<std::int64_t>(chunk_.cold);
  next_index_ = b.first_index + static_cast<std::int64_t>(b.size());
  return chunk_;
}

}  // namespace imrig::est
