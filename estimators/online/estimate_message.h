#pragma once
// Bus messages of the estimator: samples_t in, estimate_t out. Header only, so that the core knows no LCM.

#include <algorithm>
#include <imrig_msg/estimate_t.hpp>
#include <imrig_msg/samples_t.hpp>

#include "estimators/online/operating_point.h"

namespace imrig::est {

// Views into the message, which must outlive them.
inline SampleBlock block_of(const imrig_msg::samples_t& m) {
  SampleBlock block;
  block.boot_id = m.boot_id;
  block.first_index = m.first_index;
  block.sample_time_ns = m.sample_time_ns;
  block.gates_on = m.gates_on != 0;
  block.current_A_per_count = static_cast<double>(m.current_A_per_count);
  block.voltage_V_per_count = static_cast<double>(m.voltage_V_per_count);
  block.voltage_filter_s = static_cast<double>(m.voltage_filter_s);
  block.encoder_counts_per_rev = m.encoder_counts_per_rev;
  block.i_a = m.i_a;
  block.i_b = m.i_b;
  block.i_c = m.i_c;
  block.v_a = m.v_a;
  block.v_b = m.v_b;
  block.v_c = m.v_c;
  block.encoder = m.encoder;
  return block;
}

inline imrig_msg::estimate_t message_of(const OperatingPoint& point, std::int64_t seq) {
  imrig_msg::estimate_t m = {};
  m.utime = point.utime;
  m.seq = seq;
  m.estimate_v1 = 1;
  m.boot_id = point.boot_id;
  m.first_index = point.first_index;
  m.last_index = point.last_index;
  m.valid = point.valid ? 1 : 0;
  m.steady = point.steady ? 1 : 0;
  m.gaps = static_cast<std::int32_t>(std::min<std::int64_t>(point.gaps, INT32_MAX));
  m.frequency_Hz = point.frequency_Hz;
  m.speed_rpm = point.speed_rpm;
  m.slip = point.slip;
  m.voltage_V = point.voltage_V;
  m.current_A = point.current_A;
  m.phi_rad = point.phi_rad;
  m.input_power_W = point.input_power_W;
  return m;
}

}  // namespace imrig::est
