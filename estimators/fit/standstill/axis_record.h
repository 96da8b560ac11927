#pragma once
// A standstill record along its one excited axis. With the current along one line of the plane no torque
// arises, the shaft rests, and the motor is one linear circuit with real signals u and i:
//   u = Re(v e^{-ja}), i = Re(i e^{-ja}), a: principal axis of the current.
// Where the voltage passed a first-order filter that the current did not, the current has passed the same
// filter here (frame_record.h), and the first samples, which remember the filter's start, are left out.
// Assumes gates on throughout the longest stretch kept.

#include <string>
#include <vector>

#include "rig/data/record.h"

namespace imrig::est {

struct AxisRecord {
  std::string failure;  // empty when the record is one of standstill
  double sample_time_s = 0.0;
  double angle_rad = 0.0;   // of the axis, -pi/2 .. pi/2
  double noise_gain = 1.0;  // factor of the matched filter on the sigma of white current noise
  std::vector<double> u;    // V
  std::vector<double> i;    // A
  std::size_t size() const { return i.size(); }
};

// A turning shaft, a turning field or no current end in `failure`; throws Error where to_frame does.
AxisRecord axis_record(const TimeSeries& series, int pole_pairs);

}  // namespace imrig::est
