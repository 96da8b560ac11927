#pragma once
// What a campaign knows of the rig: the last word of each process, when it came, and the stream of samples.

#include <cmath>
#include <cstdint>
#include <imrig_msg/ack_t.hpp>
#include <imrig_msg/bridge_status_t.hpp>
#include <imrig_msg/dyno_status_t.hpp>
#include <imrig_msg/estimate_t.hpp>
#include <optional>
#include <string>

#include "rig/campaign/sample_watch.h"

namespace imrig {

struct RigView {
  std::optional<imrig_msg::bridge_status_t> bridge;
  std::optional<imrig_msg::dyno_status_t> dyno;
  std::optional<imrig_msg::ack_t> recorder;
  std::optional<imrig_msg::estimate_t> estimate;
  std::int64_t bridge_us = 0;  // steady time it was heard last
  std::int64_t dyno_us = 0;
  std::int64_t recorder_us = 0;
  SampleWatch watch;
  bool needs_dyno = false;
  bool needs_recorder = true;

  double sample_time_s() const { return 1e-9 * static_cast<double>(watch.sample_time_ns()); }
  std::int64_t in_samples(double seconds) const { return std::llround(seconds / sample_time_s()); }

  // First cause of a trip, 0 none: a side that only followed the other one tells less.
  std::int32_t trip() const;
  // What is still missing before a campaign can begin; empty: nothing.
  std::string missing() const;
  // What has failed while one runs; empty: nothing. now_us: steady.
  std::string failed(std::int64_t now_us) const;
};

}  // namespace imrig
