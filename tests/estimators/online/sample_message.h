#pragma once
// Synthetic samples as the message that imrig-bridge would publish.

#include <cmath>
#include <imrig_msg/samples_t.hpp>
#include <vector>

#include "tests/estimators/online/synthetic.h"

namespace imrig::est {

inline imrig_msg::samples_t sample_message(const Signal& s, const Samples& x, std::size_t at, std::size_t n,
                             std::int64_t seq) {
  imrig_msg::samples_t m = {};
  m.samples_v1 = 1;
  m.boot_id = 77;
  m.seq = seq;
  m.first_index = static_cast<std::int64_t>(at);
  m.sample_time_ns = std::llround(1e9 * s.sample_time_s);
  m.utime = m.first_index * m.sample_time_ns / 1000;
  m.segment = -1;
  m.gates_on = 1;
  m.current_A_per_count = static_cast<float>(s.i_scale);
  m.voltage_V_per_count = static_cast<float>(s.v_scale);
  m.voltage_filter_s = static_cast<float>(s.filter_s);
  m.full_scale_counts = 2047;
  m.encoder_counts_per_rev = s.counts_per_rev;
  m.stator_C = 25.0F;
  m.n = static_cast<std::int32_t>(n);
  const auto cut = [&](const auto& all) {
    const auto from = all.begin() + static_cast<std::ptrdiff_t>(at);
    return std::vector(from, from + static_cast<std::ptrdiff_t>(n));
  };
  m.i_a = cut(x.i[0]);
  m.i_b = cut(x.i[1]);
  m.i_c = cut(x.i[2]);
  m.v_a = cut(x.v[0]);
  m.v_b = cut(x.v[1]);
  m.v_c = cut(x.v[2]);
  m.encoder = cut(x.encoder);
  return m;
}

}  // namespace imrig::est
