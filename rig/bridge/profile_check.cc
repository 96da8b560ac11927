#include "rig/bridge/profile_check.h"

#include <algorithm>

#include "rig/link/device/profile.h"

namespace imrig {

using imrig_msg::segment_t;

namespace {

imrig_segment link_segment(const segment_t& s) {
  imrig_segment out = {};
  out.kind = s.kind;
  out.record = s.record;
  out.duration_samples = s.duration_samples;
  out.amplitude_start_V = s.amplitude_start_V;
  out.amplitude_end_V = s.amplitude_end_V;
  out.frequency_start_Hz = s.frequency_start_Hz;
  out.frequency_end_Hz = s.frequency_end_Hz;
  out.angle_rad = s.angle_rad;
  out.offset_A = s.offset_A;
  out.n_tones = s.n_tones;
  std::copy(std::begin(s.tone_A), std::end(s.tone_A), out.tone_A);
  std::copy(std::begin(s.tone_Hz), std::end(s.tone_Hz), out.tone_Hz);
  std::copy(std::begin(s.tone_rad), std::end(s.tone_rad), out.tone_rad);
  out.kp_V_per_A = s.kp_V_per_A;
  out.ki_V_per_As = s.ki_V_per_As;
  out.period_samples = s.period_samples;
  out.plus_phases = s.plus_phases;
  out.minus_phases = s.minus_phases;
  out.level_A = s.level_A;
  out.level_V = s.level_V;
  return out;
}

}  // namespace

CheckedProfile check_profile(const imrig_msg::bridge_cmd_t& cmd, const LimitsConfig& limits,
                             double sample_s) {
  CheckedProfile out;
  const bool known_end = cmd.at_end == imrig_msg::bridge_cmd_t::AT_END_GATES_OFF ||
                         cmd.at_end == imrig_msg::bridge_cmd_t::AT_END_HOLD;
  if (cmd.profile_id < 1 || !known_end || cmd.n_segments < 1 || cmd.n_segments > IMRIG_MAX_SEGMENTS)
    return out;
  out.profile.profile_id = cmd.profile_id;
  out.profile.at_end = cmd.at_end;
  const imrig_profile_limits device_limits = {limits.voltage_V, limits.current_A, sample_s};
  for (int k = 0; k < cmd.n_segments; ++k) {
    out.profile.segments.push_back(link_segment(cmd.segments[k]));
    const std::int32_t result = imrig_segment_check(&out.profile.segments.back(), &device_limits);
    if (result == IMRIG_DONE) continue;
    out.result = result == IMRIG_OVER_LIMIT ? CommandResult::kOverLimit : CommandResult::kMalformed;
    return out;
  }
  out.result = CommandResult::kDone;
  return out;
}

}  // namespace imrig
