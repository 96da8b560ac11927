#include "rig/bridge/profile_check.h"

#include <algorithm>
#include <cmath>

namespace imrig {

using imrig_msg::segment_t;

namespace {

constexpr int kAllPhases = 7;

bool finite(std::initializer_list<double> values) {
  return std::all_of(values.begin(), values.end(), [](double x) { return std::isfinite(x); });
}

// The regulator of CURRENT and of a DC level in A.
bool regulator_makes_sense(const segment_t& s) {
  return finite({s.kp_V_per_A, s.ki_V_per_As}) && s.kp_V_per_A >= 0 && s.ki_V_per_As >= 0 &&
         s.period_samples >= 1;
}

CommandResult check_voltage(const segment_t& s, const LimitsConfig& limits) {
  if (!finite({s.amplitude_start_V, s.amplitude_end_V, s.frequency_start_Hz, s.frequency_end_Hz}))
    return CommandResult::kMalformed;
  const double peak_V = std::max(std::abs(s.amplitude_start_V), std::abs(s.amplitude_end_V));
  return peak_V <= limits.voltage_V ? CommandResult::kDone : CommandResult::kOverLimit;
}

CommandResult check_current(const segment_t& s, const LimitsConfig& limits) {
  if (!regulator_makes_sense(s) || !finite({s.angle_rad, s.offset_A})) return CommandResult::kMalformed;
  if (s.n_tones < 0 || s.n_tones > IMRIG_TONES) return CommandResult::kMalformed;
  double peak_A = std::abs(s.offset_A);
  for (int k = 0; k < s.n_tones; ++k) {
    if (!finite({s.tone_A[k], s.tone_Hz[k], s.tone_rad[k]})) return CommandResult::kMalformed;
    peak_A += std::abs(s.tone_A[k]);
  }
  return peak_A <= limits.current_A ? CommandResult::kDone : CommandResult::kOverLimit;
}

CommandResult check_dc(const segment_t& s, const LimitsConfig& limits) {
  const bool known_phases = ((s.plus_phases | s.minus_phases) & ~kAllPhases) == 0;
  if (!known_phases || s.plus_phases == 0 || s.minus_phases == 0 || (s.plus_phases & s.minus_phases) != 0)
    return CommandResult::kMalformed;
  if (std::isnan(s.level_A)) {
    if (!finite({s.level_V})) return CommandResult::kMalformed;
    // between two sides of a star: at most twice the phase's peak
    return std::abs(s.level_V) <= 2.0 * limits.voltage_V ? CommandResult::kDone : CommandResult::kOverLimit;
  }
  if (!finite({s.level_A}) || !regulator_makes_sense(s)) return CommandResult::kMalformed;
  return std::abs(s.level_A) <= limits.current_A ? CommandResult::kDone : CommandResult::kOverLimit;
}

CommandResult check_segment(const segment_t& s, const LimitsConfig& limits) {
  if (s.duration_samples < 1 || s.record < 0) return CommandResult::kMalformed;
  switch (s.kind) {
    case segment_t::GATES_OFF:
      return CommandResult::kDone;
    case segment_t::VOLTAGE:
      return check_voltage(s, limits);
    case segment_t::CURRENT:
      return check_current(s, limits);
    case segment_t::DC:
      return check_dc(s, limits);
    default:
      return CommandResult::kMalformed;
  }
}

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

CheckedProfile check_profile(const imrig_msg::bridge_cmd_t& cmd, const LimitsConfig& limits) {
  CheckedProfile out;
  const bool known_end = cmd.at_end == imrig_msg::bridge_cmd_t::AT_END_GATES_OFF ||
                         cmd.at_end == imrig_msg::bridge_cmd_t::AT_END_HOLD;
  if (cmd.profile_id < 1 || !known_end || cmd.n_segments < 1 || cmd.n_segments > IMRIG_MAX_SEGMENTS)
    return out;
  out.profile.profile_id = cmd.profile_id;
  out.profile.at_end = cmd.at_end;
  for (int k = 0; k < cmd.n_segments; ++k) {
    out.result = check_segment(cmd.segments[k], limits);
    if (out.result != CommandResult::kDone) return out;
    out.profile.segments.push_back(link_segment(cmd.segments[k]));
  }
  return out;
}

}  // namespace imrig
