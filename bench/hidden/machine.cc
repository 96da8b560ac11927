#include "bench/hidden/machine.h"

#include <fmt/format.h>

#include <cmath>
#include <random>

#include "rig/base/space_vector.h"

namespace imrig::bench {

double uniform(std::mt19937_64& bits, double low, double high) {
  return low + (high - low) * static_cast<double>(bits() >> 11) * 0x1p-53;
}

Machine draw_machine(std::uint64_t seed) {
  std::mt19937_64 bits(seed * 0x9e3779b97f4a7c15ull + 17);
  Machine m;
  const double size = uniform(bits, 0.0, 1.0);  // 0: 0.5 kW, 1: 50 kW
  m.power_W = 500.0 * std::pow(100.0, size);
  m.f_Hz = bits() % 2 == 0 ? 50.0 : 60.0;
  m.pole_pairs = 1 + static_cast<int>(bits() % 3);
  const double line_V[] = {220.0, 400.0, 460.0};
  m.v_V = line_V[bits() % 3] * std::sqrt(2.0 / 3.0);
  m.i_A = m.power_W / ((0.70 + 0.24 * size) * (0.72 + 0.14 * size)) / (1.5 * m.v_V);
  const double w = 2.0 * kPi * m.f_Hz, Z = m.v_V / m.i_A;
  m.psi_Wb = m.v_V / w;
  m.R_s = Z * 0.075 * std::pow(0.22, size) * uniform(bits, 0.8, 1.25);
  m.R_r = Z * 0.055 * std::pow(0.25, size) * uniform(bits, 0.8, 1.25);
  m.L_l = Z / w * uniform(bits, 0.14, 0.22);
  m.L_m = Z / w * (1.4 + 1.6 * size) * uniform(bits, 0.85, 1.15);
  const double L = m.L_l + m.L_m;
  m.rotor_leakage_H = L - std::sqrt(m.L_m * L);
  m.rotor_R = m.R_r * L / m.L_m;
  m.w_slip_rad_s = 0.9 * m.R_r * m.i_A / m.psi_Wb;
  // A step from 2.8 times rated, at rest, reaches 5 times with its offset.
  m.current_range_A = 7.0 * m.i_A, m.voltage_range_V = 1.9 * m.v_V;
  m.current_noise_A = 5e-4 * m.current_range_A, m.voltage_noise_V = 7.5e-4 * m.voltage_range_V;
  return m;
}

std::string plant_toml(const Machine& m, std::uint64_t seed, const std::string& inverter_lines,
                       double current_range_A, double voltage_filter_s, const std::string& sensor_lines,
                       bool fixed_step) {
  return fmt::format(
      "version = 1\nseed = {}\nsample_time_ns = 60000\npwm_time_ns = 60000\nintegrator = \"{}\"\n"
      "[motor]\ncircuit = \"inverse-gamma\"\npole_pairs = {}\nR_s_ohm = {}\nR_r_ohm = {}\nL_l_H = {}\nL_m_H "
      "= {}\n"
      "[inverter]\ndc_link_V = {}\n{}\n[generator]\ncoupled = false\n"
      "[sensors]\ncurrent_range_A = {}\nvoltage_range_V = {}\ncurrent_noise_A = {}\nvoltage_noise_V = {}\n"
      "voltage_filter_s = {}\n{}\n",
      seed, fixed_step ? "rk4" : "sundials", m.pole_pairs, m.R_s, m.R_r, m.L_l, m.L_m, 2.3 * m.v_V,
      inverter_lines, current_range_A, m.voltage_range_V, m.current_noise_A, m.voltage_noise_V,
      voltage_filter_s, sensor_lines);
}

}  // namespace imrig::bench
