#pragma once
// A record as the fits and the prediction see it: voltage, current and electrical speed in the frame that
// turns steadily with the supply,
//   x_frame(t) = x(t) exp(-j w_k t), w_k = arg(sum v[k+1] v[k]*) / h, t = 0 at the record's first sample
//   kept.
// Where the voltage passed a first-order filter that the current did not, the current passes the same filter
// here (its exact discrete equivalent for a straight line in the frame), and the first samples, which
// remember the filter's start, are marked as not to be judged: the machine is linear, so filtered voltage
// makes filtered current. The speed passes it too: filter(w psi) = filter(w) filter(psi) up to tau^2 dw/dt
// dpsi/dt, while a speed left early would err by tau dw/dt psi, 0.03 V in a 15 Hz swing behind 1 kHz. Only
// the longest stretch with the gates on is kept.

#include <complex>
#include <cstddef>
#include <vector>

#include "rig/data/record.h"

namespace imrig::est {

// One sample of that filter, the input x on a straight line between samples:
// y[k+1] = decay y[k] + old x[k] + fresh x[k+1].
struct FilterStep {
  std::complex<double> gain;  // of a constant input
  std::complex<double> decay, old, fresh;
};

struct FrameRecord {
  double sample_time_s = 0.0;
  double w_k = 0.0;                     // speed of the frame, electrical rad/s, signed
  std::size_t first = 0;                // sample of the series that is sample 0 here
  std::size_t judged_from = 0;          // samples before it start the filter
  std::vector<std::complex<double>> v;  // V
  std::vector<std::complex<double>> i;  // A, after the matched filter
  std::vector<double> w_r;              // electrical rad/s, after the same filter
  int pole_pairs = 1;
  double filter_s = 0.0;    // time constant of the matched filter; 0: none
  double noise_gain = 1.0;  // factor of the matched filter on the sigma of white current noise
  std::size_t size() const { return i.size(); }
  // The factor exp(j w_k t_k) that turns a vector of sample k back to the stationary frame.
  std::complex<double> back(std::size_t k) const;
  // The matched filter in the frame; only where there is one.
  FilterStep filter_step() const;
  // Impulse response of the matched filter in the frame, until it is forgotten; {1} without a filter.
  std::vector<std::complex<double>> filter_response() const;
};

// Throws Error when the series is too short, holds missing values or has lengths that do not match.
FrameRecord to_frame(const TimeSeries& series, int pole_pairs);

// A second difference so large beside the voltage is a step: no smooth curve lies in it.
inline constexpr double kBend = 0.1;

// Machines are driven along straight lines between samples, whose integral misses that of a smooth curve by
// h^2/12 of its bend and more: 5 % of a fifth harmonic sampled at 2.5 kHz. Moves each sample, but at steps,
// so that the lines hold the curve's integral: with s = (2 sin(w h/2))^2 by the first terms of (w h/2)^-1
// tan(w h/2) = 1 + s/12 + 11 s^2/720. Noise is no curve: the correction goes as the fourth differences fall
// below what white noise would make of them.
void straighten(std::vector<std::complex<double>>& v);

// to_frame with the voltage straightened: for driving a machine, not for looking at the voltage's noise.
FrameRecord to_driving_frame(const TimeSeries& series, int pole_pairs);

}  // namespace imrig::est
