#pragma once
// Bus messages of the estimator: samples_t in, estimate_t and motor_estimate_t out. Header only, so that the core
// knows no LCM.

#include <algorithm>
#include <imrig_msg/estimate_t.hpp>
#include <imrig_msg/motor_estimate_t.hpp>
#include <imrig_msg/samples_t.hpp>

#include "estimators/online/estimator.h"

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
  block.stator_C = static_cast<double>(m.stator_C);
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

namespace message_part {

inline imrig_msg::quantity_t of(const Quantity& q, const MotorEstimate& e) {
  const double half = kNormal95 * q.sigma;
  const double age_s = static_cast<double>(e.point.last_index - q.last_index) * e.sample_time_s;
  imrig_msg::quantity_t m = {};
  m.value = q.value;
  m.low = q.value - half;
  m.high = q.value + half;
  m.age_s = q.known() ? age_s : kUnknown;
  return m;
}

inline void window(const MotorEstimate& e, imrig_msg::motor_estimate_t& m) {
  const OperatingPoint& p = e.point;
  m.utime = p.utime;
  m.boot_id = p.boot_id;
  m.first_index = p.first_index;
  m.last_index = p.last_index;
  m.missing_samples = e.missing_samples;
  m.window = e.window ? 1 : 0;
  m.valid = p.valid ? 1 : 0;
  m.steady = p.steady ? 1 : 0;
  m.moved = p.moved;
  m.frequency_Hz = of(e.frequency_Hz, e);
  m.slip = of(e.slip, e);
  m.voltage_V = of(e.voltage_V, e);
  m.current_A = of(e.current_A, e);
  m.phi_rad = of(e.phi_rad, e);
  m.input_power_W = of(e.input_power_W, e);
  m.stator_flux_Wb = of(e.stator_flux_Wb, e);
  m.rotor_flux_Wb = of(e.rotor_flux_Wb, e);
  m.torque_Nm = of(e.torque_Nm, e);
}

inline void findings(const MotorEstimate& e, imrig_msg::motor_estimate_t& m) {
  const Findings& f = e.findings;
  m.rotor_status = static_cast<std::int32_t>(f.rotor_status);
  m.R_r_ohm = of(f.R_r_ohm, e);
  m.R_1_ohm = of(f.R_1_ohm, e);
  m.R_r_here_ohm = of(e.R_r_here_ohm, e);
  m.R_r_elsewhere_ohm = of(e.R_r_elsewhere_ohm, e);
  m.w_elsewhere_rad_s = e.w_elsewhere_rad_s;
  m.R_s_source = static_cast<std::int32_t>(f.R_s_source);
  m.R_s_ohm = of(f.R_s_ohm, e);
  m.stator_C = of(f.stator_C, e);
  m.rotor_C = of(e.rotor_C, e);
  m.joint_R_r_ohm = of(f.joint_R_r_ohm, e);
  m.joint_R_s_ohm = of(f.joint_R_s_ohm, e);
  m.joint_L_m_H = of(f.joint_L_m_H, e);
  m.standstill = static_cast<std::int32_t>(f.standing);
  m.standstill_R_s_ohm = of(f.standing_parameters[0], e);
  m.standstill_R_r_ohm = of(f.standing_parameters[1], e);
  m.standstill_L_l_H = of(f.standing_parameters[2], e);
  m.standstill_L_m_H = of(f.standing_parameters[3], e);
}

inline void model(const MotorEstimate& e, imrig_msg::motor_estimate_t& m) {
  m.model_current_A = of(e.model_current_A, e);
  m.model_phi_rad = of(e.model_phi_rad, e);
  m.residual_share = of(e.residual_share, e);
  m.simulated_rms_A = e.findings.simulated_rms_A;
  m.condition_f_Hz = e.condition.f_Hz;
  m.condition_V = e.condition.v_V;
  m.condition_w_s_rad_s = e.condition.w_s_rad_s;
  m.windows_here = e.windows_here;
  m.residual_here = of(e.residual_here, e);
  m.drift_here = of(e.drift_here, e);
}

}  // namespace message_part

inline imrig_msg::motor_estimate_t message_of(const MotorEstimate& e, std::int64_t seq) {
  imrig_msg::motor_estimate_t m = {};
  m.seq = seq;
  m.motor_estimate_v1 = 1;
  message_part::window(e, m);
  message_part::findings(e, m);
  message_part::model(e, m);
  return m;
}

}  // namespace imrig::est
