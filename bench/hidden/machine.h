#pragma once
// A motor drawn from a seed: 0.5 to 50 kW, per-unit parameters as motors of that size have them (small ones
// resistive, large ones not), scattered. Base quantities are peak values of a phase of the star.

#include <cstdint>
#include <random>
#include <string>

#include "rig/base/space_vector.h"

namespace imrig::bench {

struct Machine {
  double power_W = 0.0, f_Hz = 0.0;
  int pole_pairs = 2;
  double v_V = 0.0, i_A = 0.0, psi_Wb = 0.0;            // rated, peak
  double R_s = 0.0, R_r = 0.0, L_l = 0.0, L_m = 0.0;    // inverse-gamma, ohm and H
  double rotor_leakage_H = 0.0, rotor_R = 0.0;          // of the T circuit with equal self-inductances
  double w_slip_rad_s = 0.0;                            // rated, electrical
  double current_noise_A = 0.0, voltage_noise_V = 0.0;  // of a phase's sample, one sigma
  double current_range_A = 0.0, voltage_range_V = 0.0;  // of the converters, +-

  double speed_rad_s() const { return (2.0 * kPi * f_Hz - w_slip_rad_s) / pole_pairs; }  // rated
  double torque_Nm() const { return power_W / speed_rad_s(); }
};

// The same on every machine, unlike the library's distributions; [low, high).
double uniform(std::mt19937_64& bits, double low, double high);

Machine draw_machine(std::uint64_t seed);

// The plant's tables for it, without effects. The fixed step is fast, and too long for
// shallow rotor bars.
std::string plant_toml(const Machine& machine, std::uint64_t seed, const std::string& inverter_lines,
                       double current_range_A, double voltage_filter_s, const std::string& sensor_lines,
                       bool fixed_step);

}  // namespace imrig::bench
