#pragma once
// Small well-formed messages of each type with lengths inside, and their bytes.

#include <cstdint>
#include <imrig_msg/campaign_status_t.hpp>
#include <imrig_msg/dataset_t.hpp>
#include <imrig_msg/points_t.hpp>
#include <imrig_msg/record_t.hpp>
#include <imrig_msg/remark_t.hpp>
#include <imrig_msg/samples_t.hpp>
#include <imrig_msg/series_t.hpp>
#include <string>
#include <vector>

namespace imrig::test {

using ByteVector = std::vector<std::uint8_t>;

template <class Message>
ByteVector encoded(const Message& message) {
  ByteVector bytes(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

inline imrig_msg::samples_t samples(std::int32_t n = 3) {
  imrig_msg::samples_t m = {};
  m.samples_v1 = 1;
  m.boot_id = 77;
  m.sample_time_ns = 60000;
  m.current_A_per_count = 0.02F;
  m.voltage_V_per_count = 0.2F;
  m.full_scale_counts = 2047;
  m.encoder_counts_per_rev = 4096;
  m.n = n;
  const auto size = static_cast<std::size_t>(n);
  for (auto* column : {&m.i_a, &m.i_b, &m.i_c, &m.v_a, &m.v_b, &m.v_c}) column->assign(size, 11);
  m.encoder.assign(size, 5);
  return m;
}

inline imrig_msg::series_t series(std::int32_t n = 3) {
  imrig_msg::series_t m = {};
  m.series_v1 = 1;
  m.number = 1;
  m.sample_time_s = 1e-4;
  m.n_samples = m.n_voltage = m.n_speed = m.n_gates = n;
  const auto size = static_cast<std::size_t>(n);
  for (auto* column : {&m.i_alpha_A, &m.i_beta_A, &m.v_alpha_V, &m.v_beta_V, &m.speed_rad_s})
    column->assign(size, 1.5);
  m.gates_on.assign(size, 1);
  return m;
}

inline imrig_msg::points_t points(std::int32_t n = 2) {
  imrig_msg::points_t m = {};
  m.points_v1 = 1;
  m.number = 1;
  m.n = n;
  for (auto* column : {&m.v_peak_V, &m.f_Hz, &m.i_peak_A, &m.p_in_W, &m.power_factor, &m.q_var,
                       &m.speed_rad_s, &m.torque_Nm, &m.p_out_W, &m.stator_C}) {
    column->assign(static_cast<std::size_t>(n), 2.5);
  }
  return m;
}

inline imrig_msg::record_t record(const std::string& id = "f60") {
  imrig_msg::record_t m = {};
  m.record_v1 = 1;
  m.phase = imrig_msg::record_t::BEGIN;
  m.number = 1;
  m.id = id;
  m.kind = "step";
  m.campaign = "test";
  m.pole_pairs = 2;
  m.repeat_of = "other";
  return m;
}

inline imrig_msg::dataset_t dataset(const std::string& name = "bench") {
  imrig_msg::dataset_t m = {};
  m.dataset_v1 = 1;
  m.name = name;
  m.pole_pairs = 2;
  return m;
}

inline imrig_msg::remark_t remark(const std::string& text = "said") {
  imrig_msg::remark_t m = {};
  m.remark_v1 = 1;
  m.text = text;
  return m;
}

inline imrig_msg::campaign_status_t campaign_status() {
  imrig_msg::campaign_status_t m = {};
  m.campaign_status_v1 = 1;
  m.plan = "grid";
  m.point_id = "f60";
  return m;
}

}  // namespace imrig::test
