#pragma once
// Runs of raw samples to what the running estimators eat: vectors in V and A without the sensors' zeros, the
// current behind the voltage channel's filter, the shaft's speed. Everything starts anew at a gap, a reboot or a
// change of the channels.

#include <array>
#include <complex>
#include <cstdint>

#include "estimators/online/matched_filter.h"
#include "estimators/online/operating_point.h"
#include "estimators/online/shaft_watch.h"
#include "estimators/online/zero_watch.h"

namespace imrig::est {

struct Chunk {
  static constexpr std::size_t kMost = 256;
  std::int64_t first_index = 0;
  std::size_t n = 0;
  double sample_time_s = 0.0, voltage_filter_s = 0.0, stator_C = 0.0;
  bool gates_on = false;
  bool fresh = false;  // something was interrupted before its first sample
  std::size_t cold = 0;  // so many of its first samples come before the filter has forgotten its start
  std::array<std::complex<double>, kMost> v, i;
  std::array<double, kMost> speed_rad_s;  // mechanical; NaN where not known
  std::array<bool, kMost> at_rest;
};

class SampleIntake {
 public:
  // At most Chunk::kMost samples. The chunk is good until the next call.
  const Chunk& take(const SampleBlock& block);
  // Direct parts of the raw vectors while the motor runs, for a rig that was never seen at rest.
  void suggest_zero(std::complex<double> v_V, std::complex<double> i_A) {
    v_zero_ = v_V;
    i_zero_ = i_A;
    suggested_ = true;
  }
  bool zero_known() const { return zeros_.measured() || suggested_; }
  std::int64_t dropouts() const { return shaft_.dropouts(); }

 private:
  static constexpr double kForgotten = 12.0;  // time constants of the filter
  bool same_channel(const SampleBlock& b) const {
    return b.boot_id == boot_id_ && b.sample_time_ns == sample_time_ns_ && b.current_A_per_count == current_scale_ &&
           b.voltage_V_per_count == voltage_scale_ && b.voltage_filter_s == chunk_.voltage_filter_s &&
           b.encoder_counts_per_rev == counts_per_rev_;
  }
  void take_channel(const SampleBlock& b);

  Chunk chunk_;
  ZeroWatch zeros_;
  ShaftWatch shaft_;
  MatchedFilter filter_;
  std::complex<double> v_zero_, i_zero_;
  bool started_ = false, suggested_ = false;
  std::int64_t boot_id_ = 0, sample_time_ns_ = 0, next_index_ = 0, cold_ = 0;
  double current_scale_ = 0.0, voltage_scale_ = 0.0;
  int counts_per_rev_ = 0;
};

}  // namespace imrig::est
