#pragma once
// A time series as the global fit sees it: in the frame of the supply (frame_record.h), at a rate that the
// machine's dynamics need and no more, with what the effects ask for.
//
// Thinning: voltage, current and speed are averaged over `thinned` samples. The machine is linear in the
// frame over so short a time, so averaged voltage makes averaged current; noise falls with the root.

#include <cstdint>
#include <vector>

#include "estimators/fit/global/torque_windows.h"
#include "estimators/model/effects/effect.h"
#include "estimators/model/frame_record.h"

namespace imrig::est {

inline constexpr double kThinnedTime_s = 5e-4;  // longest sample time that thinning makes, and
inline constexpr double kThinnedTurn =
    0.2;  // the most that the frame turns in it, rad: decaying flux stands still

// Samples that may be averaged into one of at most longest_s; 1 at least.
std::size_t most_averaged(double sample_time_s, double longest_s);

struct DrivenRecord {
  std::size_t index = 0;  // in the data set
  bool holdout = false;
  FrameRecord frame;
  int thinned = 1;
  double mean_gain = 1.0;  // sigma of current noise here over that of one sample of the series
  std::vector<std::complex<double>> voltage_rate;  // V/s, stationary derivative seen in the frame
  std::vector<double> stator_C;                    // empty: not measured
  std::vector<std::complex<double>> rotor_turn;    // exp(j (theta_r - theta_k)), theta_r = 0 at the start
  std::vector<double> speed_rate, speed_bend;  // d/dt of the speed, electrical rad/s^2, and again, rad/s^3
  double speed_sigma = 0.0;                        // of a held speed that was rounded, electrical rad/s
  std::vector<TorqueWindow> torque;                // to be judged beside the current; empty until asked for

  std::size_t size() const { return frame.size(); }
  Instant at(std::size_t k) const;
  // What the matched filter leaves of a torque of filtered flux and current.
  double torque_gain() const;
};

// longest_s: sample time that thinning may make; 0: none.
// Throws Error when the series cannot be used (frame_record.h).
DrivenRecord driven_record(const TimeSeries& series, int pole_pairs, double longest_s = kThinnedTime_s);

}  // namespace imrig::est
