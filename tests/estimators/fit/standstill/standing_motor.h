#pragma once
// Standstill records made by another route than the fitted model's: T circuit with both currents as states,
//   [L_s L_m; L_m L_r] d/dt [i_s i_r] = [u - R_s i_s, -R_r i_r],
// together with the voltage filter as a third state, matrix exponential over each sample with the voltage
// held; a PI regulator at its own period follows a sum of sines, as in Fang, Lin and Wang 2005.

#include <cstdint>
#include <vector>

#include "rig/data/record.h"

namespace imrig::est::standing {

struct Motor {
  double R_s = 0.0, R_r = 0.0, L_ls = 0.0, L_lr = 0.0, L_m = 0.0;  // T circuit
};

struct Tone {
  double amplitude_A = 0.0;
  double w_rad_s = 0.0;
};

struct Experiment {
  double seconds = 6.0;
  double sample_time_s = 60e-6;
  int regulator_every = 5;  // samples: 0.3 ms
  double kp = 1.6, ki = 116.0;
  double offset_A = 0.0;
  std::vector<Tone> tones{{3.0, 12.0}, {4.0, 25.0}, {6.0, 70.0}};
  double axis_rad = 1.5707963267948966;
  double filter_s = 160e-6;      // of the voltage channel; 0: none
  double current_noise_A = 0.0;  // one sigma, each component; the regulator sees it
  double voltage_noise_V = 0.0;
  double voltage_zero_V = 0.0, current_zero_A = 0.0;  // of the sensors, along the axis
  std::uint64_t seed = 1;
};

TimeSeries record(const Motor& motor, const Experiment& experiment);

}  // namespace imrig::est::standing
