#pragma once
// Records made by another route than the fitted model's: T circuit in flux and current form, stationary
// frame, matrix exponential of the machine together with its sinusoidal supply and the voltage filter (exact
// at constant speed; fine steps where the speed moves).

#include <cstdint>
#include <functional>
#include <vector>

#include "rig/data/record.h"

namespace imrig::est::synthetic {

// Per phase of the star, ohm and H.
struct Motor {
  const char* name = "";
  int pole_pairs = 2;
  double R_s = 0.0, R_r = 0.0, L_ls = 0.0, L_lr = 0.0, L_m = 0.0;
  double v_peak_V = 0.0;  // rated
  double f_Hz = 0.0;
  double slip = 0.0;  // rated
};

const std::vector<Motor>& motors();  // 0.5, 4 (the 2002 paper's), 18.5 and 50 kW

struct Case {
  double f_Hz = 0.0;  // signed
  double v_peak_V = 0.0;
  double step = 0.1;  // relative, of the voltage
  double step_at_s = 0.0;
  double sample_time_s = 60e-6;
  std::size_t samples = 5000;
  double filter_s = 0.0;                  // of the voltage channels
  int fine = 1;                           // steps per sample
  SpaceVector start_off_stator_Wb = 0.0;  // added to the start (T circuit fluxes)
  SpaceVector start_off_rotor_Wb = 0.0;
  bool from_rest = false;                     // start without flux instead of in the steady state
  std::function<double(double)> speed_rad_s;  // mechanical, of time
};

// A voltage step at constant slip (of the initial speed), in the middle fifth of the record.
Case step_case(const Motor& motor, double relative_voltage, double relative_frequency, double slip,
               double sample_time_s, std::size_t samples);

TimeSeries record(const Motor& motor, const Case& c);

void add_noise(TimeSeries& series, double current_A, double voltage_V, double speed_rad_s,
               std::uint64_t seed);

}  // namespace imrig::est::synthetic
