#pragma once
// A device on the bench: the real C99 state machine, spoken to in frames, sampled by hand.

#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "rig/link/device/imrig_device.h"
#include "rig/link/frame_reader.h"
#include "rig/link/frame_writer.h"

namespace imrig::test {

inline constexpr double kSample_s = 60e-6;
inline constexpr float kAmpPerCount = 0.02f;
inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

struct Heard {
  std::vector<imrig_welcome> welcomes;
  std::vector<imrig_reply> replies;
  std::vector<imrig_block> blocks;
  std::vector<imrig_status> statuses;
  int other = 0;
};

inline void hear(std::span<const std::uint8_t> payload, Heard& heard) {
  imrig_welcome welcome;
  imrig_reply reply;
  imrig_block block;
  imrig_status status;
  if (imrig_decode_welcome(payload.data(), payload.size(), &welcome)) {
    heard.welcomes.push_back(welcome);
  } else if (imrig_decode_reply(payload.data(), payload.size(), &reply)) {
    heard.replies.push_back(reply);
  } else if (imrig_decode_block(payload.data(), payload.size(), &block)) {
    heard.blocks.push_back(block);
  } else if (imrig_decode_status(payload.data(), payload.size(), &status)) {
    heard.statuses.push_back(status);
  } else {
    ++heard.other;
  }
}

inline imrig_device_config bench_config() {
  imrig_device_config config = {};
  config.boot_id = 4711;
  config.sample_time_ns = 60000;
  config.pwm_samples = 4;
  config.current_A_per_count = kAmpPerCount;
  config.voltage_V_per_count = 0.2f;
  config.voltage_filter_s = 160e-6f;
  config.full_scale_counts = 2048;
  config.encoder_counts_per_rev = 4096;
  return config;
}

inline imrig_hello bench_hello(std::int64_t nonce = 1) {
  return {0, 1, 1, nonce, 300, 30.0, 3000.0, 130.0, 230.0};
}

inline imrig_segment voltage_segment(std::int64_t samples, double v0, double v1, double f0, double f1) {
  imrig_segment s = {};
  s.kind = IMRIG_VOLTAGE;
  s.duration_samples = samples;
  s.amplitude_start_V = v0;
  s.amplitude_end_V = v1;
  s.frequency_start_Hz = f0;
  s.frequency_end_Hz = f1;
  return s;
}

inline imrig_segment off_segment(std::int64_t samples) {
  imrig_segment s = {};
  s.kind = IMRIG_GATES_OFF;
  s.duration_samples = samples;
  return s;
}

class DeviceBench {
 public:
  explicit DeviceBench(const imrig_device_config& config = bench_config())
      : device(std::make_unique<imrig_device>()) {
    imrig_device_init(device.get(), &config);
    counts.stator_C = std::numeric_limits<float>::quiet_NaN();
  }

  void feed(const std::vector<std::uint8_t>& bytes) {
    imrig_device_feed(device.get(), bytes.data(), bytes.size(), now_ms);
  }
  void say(const imrig_hello& m) { feed(frame_of(imrig_encode_hello, m)); }
  void say(const imrig_segment& m) { feed(frame_of(imrig_encode_segment, m)); }
  void say(const imrig_commit& m) { feed(frame_of(imrig_encode_commit, m)); }
  void say(const imrig_order& m) { feed(frame_of(imrig_encode_order, m)); }
  void say(const imrig_credit& m) { feed(frame_of(imrig_encode_credit, m)); }

  void hello(std::int64_t nonce = 1) { say(bench_hello(nonce)); }

  // Result of the commit, or of the first segment that is refused.
  std::int32_t upload(std::int32_t profile_id, std::vector<imrig_segment> segments, std::int32_t at_end) {
    for (std::size_t k = 0; k < segments.size(); ++k) {
      segments[k].seq = ++seq;
      segments[k].segment_v1 = 1;
      segments[k].profile_id = profile_id;
      segments[k].position = static_cast<std::int32_t>(k);
      say(segments[k]);
      if (const std::int32_t result = last_result(); result != IMRIG_DONE) return result;
    }
    say(imrig_commit{0, ++seq, 1, profile_id, static_cast<std::int32_t>(segments.size()), at_end});
    return last_result();
  }

  std::int32_t order(std::int32_t action, std::int32_t profile_id = 0, double ramp_s = 0.0) {
    say(imrig_order{0, ++seq, 1, action, profile_id, ramp_s});
    return last_result();
  }

  std::int32_t last_result() {
    drain();
    return heard.replies.empty() ? -99 : heard.replies.back().result;
  }

  imrig_command sample() {
    const imrig_command command = imrig_device_sample(device.get(), &counts);
    drain();
    return command;
  }
  // The commands of n samples.
  std::vector<imrig_command> samples(int n) {
    std::vector<imrig_command> commands;
    for (int k = 0; k < n; ++k) commands.push_back(sample());
    return commands;
  }

  void tick(std::int64_t at_ms) {
    now_ms = at_ms;
    imrig_device_tick(device.get(), now_ms);
    drain();
  }

  void drain() {
    std::vector<std::uint8_t> out(IMRIG_FRAME_MAX);
    for (std::size_t n; (n = imrig_device_take(device.get(), out.data(), out.size())) != 0;) {
      reader.feed({out.data(), n}, [&](std::span<const std::uint8_t> payload) { hear(payload, heard); });
    }
  }

  std::unique_ptr<imrig_device> device;
  imrig_counts counts = {};
  std::int64_t now_ms = 1000;
  std::int64_t seq = 100;
  Heard heard;
  FrameReader reader;
};

}  // namespace imrig::test
