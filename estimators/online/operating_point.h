#pragma once
// Operating point of the motor from raw samples, one estimate per window of a whole number of periods.
// docs/estimator.md derives it.
//
//   frequency  zero crossings of v_alpha and v_beta with hysteresis, each interpolated by a line fit; then
//   the
//              phase slope between the two halves of the window, repeated. Signed by the phase order:
//              positive for a-b-c.
//   phasors    least squares of x(t) = X+ e^{jwt} + X- e^{-jwt} + X0 over the window, for v and i: neither a
//              sensor's zero, nor an unbalance, nor the fraction of a sample at the window's end biases X+.
//   voltage    V = X+ (1 + jw tau): the anti-alias filter (first order, time constant tau) is undone; where the
//              inverter holds its voltage from sample to sample, by the answer to such steps (held_voltage.h).
//   power      mean of (3/2) Re(v i*) over the window without its DC part, the fundamental's share from the
//              corrected V.
//   speed      slope of a straight line through the encoder counts; slip = 1 - n_p * (speed/60) / f.
//   steady     see steady_criterion.h.
//
// A window ends where gates switch, samples are missing or the device rebooted; a new one starts behind that.
// Depends on nothing but the samples and their order: any cut into blocks gives the same bits. Allocates when
// the sample time becomes known, never per sample after that.

#include <complex>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <span>

namespace imrig::est {

// One run of consecutive samples: raw counts and their scale, as samples_t holds them. All spans have the
// same length.
struct SampleBlock {
  std::int64_t boot_id = 0;
  std::int64_t first_index = 0;     // >= 0, on the device's clock
  std::int64_t sample_time_ns = 0;  // 5 us .. 10 ms, else the block is refused
  bool gates_on = false;
  double current_A_per_count = 0.0;
  double voltage_V_per_count = 0.0;
  double voltage_filter_s = 0.0;   // 0: no filter
  int encoder_counts_per_rev = 0;  // 0: no encoder, speed and slip are NaN
  std::span<const std::int16_t> i_a, i_b, i_c, v_a, v_b, v_c;
  std::span<const std::int32_t> encoder;  // accumulated counts, wraps at 2^32
  double stator_C = std::numeric_limits<double>::quiet_NaN();  // thermocouple; NaN without one

  std::size_t size() const { return encoder.size(); }
  // Samples from .. from + n - 1 as a block of their own.
  SampleBlock part(std::size_t from, std::size_t n) const {
    SampleBlock b = *this;
    b.first_index += static_cast<std::int64_t>(from);
    for (auto counts : {&SampleBlock::i_a, &SampleBlock::i_b, &SampleBlock::i_c, &SampleBlock::v_a,
                        &SampleBlock::v_b, &SampleBlock::v_c})
      b.*counts = (this->*counts).subspan(from, n);
    b.encoder = encoder.subspan(from, n);
    return b;
  }
};

struct OperatingPoint {
  std::int64_t boot_id = 0;
  std::int64_t first_index = 0;  // window
  std::int64_t last_index = 0;
  std::int64_t utime = 0;  // us, rig time of the last sample
  bool valid = false;      // gates on and a fundamental found; else only speed is meant
  bool steady = false;
  int moved = 0;           // SteadyCriterion's bits: what keeps it from being steady
  std::int64_t gaps = 0;      // samples missing since the previous window's end; the window itself is whole
  double frequency_Hz = 0.0;  // signed
  double speed_rpm = 0.0;     // mechanical
  double slip = 0.0;
  double voltage_V = 0.0;  // peak of the fundamental, filter undone
  double current_A = 0.0;  // peak of the fundamental
  double phi_rad = 0.0;    // voltage ahead of current
  double input_power_W = 0.0;
  std::complex<double> voltage_zero_V, current_zero_A;  // DC part of the raw vectors
  // One sigma, from the residual of the fits.
  double sigma_frequency_Hz = 0.0, sigma_voltage_V = 0.0, sigma_current_A = 0.0, sigma_slip = 0.0;
};

struct OperatingPointConfig {
  int pole_pairs = 2;
  double window_s = 0.2;         // shortest window; longer for two periods of a low frequency
  double lowest_Hz = 0.5;        // below: no fundamental
  double least_voltage_V = 0.5;  // rms of the voltage vector below which no fundamental is looked for
  bool voltage_held = false;     // the inverter holds its voltage from sample to sample: true for the rig's
  double leakage_H = 0.0;        // L_l, for the ripple that such steps make in the current; 0: not undone
};

class OperatingPointEstimator {
 public:
  using Sink = std::function<void(const OperatingPoint&)>;

  // Throws Error on a configuration out of range.
  OperatingPointEstimator(const OperatingPointConfig& config, Sink sink);
  ~OperatingPointEstimator();

  // Blocks in order. One that lies before what has been read, or is malformed, is passed over: false.
  bool feed(const SampleBlock& block);
  std::int64_t boot_id() const;
  std::int64_t read_index() const;  // all samples below have been handled
  // A window cannot end before this many more samples, all in one run, have been fed; 0 before the first.
  std::size_t least_to_end() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace imrig::est
