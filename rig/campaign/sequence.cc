#include "rig/campaign/sequence.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "rig/base/space_vector.h"

namespace imrig {

namespace {

using imrig_msg::segment_t;

constexpr double kMagnetise_s = 0.4;       // at the boost voltage before the shaft starts to turn
constexpr double kAccelerateShare = 0.25;  // of the pull-out torque at travelling flux
constexpr double kCrawl = 0.25;            // share of the ramp's rate below crawl_Hz
constexpr double kLoadedMove = 0.25;  // voltage changes up to this share are made with the lesser load on
constexpr double kRestBound_s = 90.0;
constexpr double kPastPullOut = 2.5;
constexpr int kTail = 8;             // samples after a record, so that its last block is sent at once
constexpr int kRegulatorPeriod = 4;  // samples: one PWM cycle

std::int64_t samples_in(const Travel& travel, double seconds) {
  return std::max<std::int64_t>(1, std::llround(seconds / travel.sample_time_s));
}

segment_t blank(const Travel& travel, std::int32_t kind, double seconds) {
  segment_t s = {};
  s.kind = kind;
  s.duration_samples = samples_in(travel, seconds);
  s.period_samples = kRegulatorPeriod;
  s.level_A = std::numeric_limits<double>::quiet_NaN();
  return s;
}

segment_t voltage(const Travel& travel, double seconds, Operating from, Operating to) {
  segment_t s = blank(travel, segment_t::VOLTAGE, seconds);
  s.amplitude_start_V = from.voltage_V;
  s.amplitude_end_V = to.voltage_V;
  s.frequency_start_Hz = from.frequency_Hz;
  s.frequency_end_Hz = to.frequency_Hz;
  return s;
}

bool same(double a, double b) { return std::abs(a - b) < 1e-9; }
bool resting(const Operating& o) { return o.frequency_Hz == 0.0 && o.voltage_V == 0.0; }

// Builds a chain of ramps that meet end to end.
class Route {
 public:
  Route(const Travel& travel, Operating start) : travel_(travel), here_(start) {}

  void voltage_to(double v_V) {
    if (same(here_.voltage_V, v_V)) return;
    ramp({here_.frequency_Hz, v_V}, std::abs(v_V - here_.voltage_V) / travel_.voltage_ramp_V_per_s);
  }
  // Along the travelling line, whose knee lies at rated frequency; slowly where the rotor swings.
  void frequency_to(double f_Hz) {
    const bool up = f_Hz > here_.frequency_Hz;
    const double low = std::min(travel_.crawl_Hz, travel_.rated_Hz);
    for (const double knee : {up ? low : travel_.rated_Hz, up ? travel_.rated_Hz : low})
      if ((here_.frequency_Hz - knee) * (f_Hz - knee) < 0) along(knee);
    along(f_Hz);
  }
  void stay(double seconds) { ramp(here_, seconds); }
  std::vector<segment_t> segments() { return std::move(segments_); }

 private:
  void along(double f_Hz) {
    if (same(here_.frequency_Hz, f_Hz)) return;
    const double fastest = std::max(here_.frequency_Hz, f_Hz);
    const double weakening = travel_.rated_Hz / std::max(fastest, travel_.rated_Hz);
    const double share = fastest <= travel_.crawl_Hz ? kCrawl : weakening * weakening;
    const double rate = travel_.frequency_ramp_Hz_per_s * share;
    ramp({f_Hz, travelling_V(travel_, f_Hz)}, std::abs(f_Hz - here_.frequency_Hz) / rate);
  }
  void ramp(Operating to, double seconds) {
    segments_.push_back(voltage(travel_, seconds, here_, to));
    here_ = to;
  }

  const Travel& travel_;
  Operating here_;
  std::vector<segment_t> segments_;
};

segment_t recorded(segment_t s) {
  s.record = 1;
  return s;
}

}  // namespace

std::int64_t Profile::total_samples() const {
  std::int64_t n = 0;
  for (const auto& s : segments) n += s.duration_samples;
  return n;
}

std::int64_t Profile::recorded_samples() const {
  std::int64_t n = 0;
  for (const auto& s : segments)
    if (s.record != 0) n += s.duration_samples;
  return n;
}

Travel travel_of(const Plan& plan, const RigConfig& rig, double sample_time_s) {
  const MotorConfig& m = rig.motor;
  Travel travel;
  travel.sample_time_s = sample_time_s;
  travel.rated_V = rated_peak_V(m);
  travel.rated_Hz = m.rated_frequency_Hz;
  const double w = 2 * kPi * m.rated_frequency_Hz;
  const double magnetizing_A = travel.rated_V / (w * (m.L_m_H + m.L_l_H));
  travel.boost_V = 1.5 * m.R_s_ohm * magnetizing_A;
  const double flux = travel.rated_V / w;
  const double pull_out_Nm = 1.5 * m.pole_pairs * flux * flux / (2 * m.L_l_H);
  const double able_Hz_per_s = kAccelerateShare * pull_out_Nm / m.J_kgm2 * m.pole_pairs / (2 * kPi);
  travel.frequency_ramp_Hz_per_s = std::min(plan.motion.frequency_ramp_Hz_per_s, able_Hz_per_s);
  travel.crawl_Hz = (m.R_s_ohm + m.R_r_ohm) / (2 * kPi * m.L_l_H);
  travel.voltage_ramp_V_per_s = plan.motion.voltage_ramp_V_per_s;
  travel.unload_s = plan.motion.unload_s;
  travel.most_slip = std::min(0.9, 2 * plan.limits.slip);
  travel.R_s_ohm = m.R_s_ohm;
  travel.R_r_ohm = m.R_r_ohm;
  travel.L_l_H = m.L_l_H;
  return travel;
}

double travelling_V(const Travel& travel, double frequency_Hz) {
  const double share = std::min(1.0, frequency_Hz / travel.rated_Hz);
  return travel.boost_V + (travel.rated_V - travel.boost_V) * share;
}

double stalling_slip(const Travel& travel, double frequency_Hz) {
  const double leakage_ohm = 2 * kPi * frequency_Hz * travel.L_l_H;
  return std::min(travel.most_slip, kPastPullOut * travel.R_r_ohm / std::hypot(travel.R_s_ohm, leakage_ohm));
}

Profile move_profile(const Travel& travel, const Operating& from, const Operating& to) {
  Profile profile;
  if (same(from.frequency_Hz, to.frequency_Hz) && same(from.voltage_V, to.voltage_V)) return profile;
  Route route(travel, from);
  if (!same(from.frequency_Hz, to.frequency_Hz)) {
    route.voltage_to(travelling_V(travel, from.frequency_Hz));
    if (resting(from)) route.stay(kMagnetise_s);
    route.frequency_to(to.frequency_Hz);
  }
  route.voltage_to(to.voltage_V);
  profile.segments = route.segments();
  profile.hold_at_end = !resting(to);
  return profile;
}

namespace {

Profile dc_profile(const Travel& travel, const PlanPoint& point) {
  segment_t s = blank(travel, segment_t::DC, point.settle_s);
  s.plus_phases = 1 | 4;  // a and c
  s.minus_phases = 2;     // b
  s.level_A = point.level_A;
  s.kp_V_per_A = point.tones.kp_V_per_A;
  s.ki_V_per_As = point.tones.ki_V_per_As;
  segment_t record = recorded(s);
  record.duration_samples = samples_in(travel, point.record_s);
  Profile profile;
  if (point.settle_s > 0) profile.segments.push_back(s);
  profile.segments.push_back(record);
  profile.hold_at_end = false;
  return profile;
}

// Regulated current along one axis: no torque.
segment_t tones_segment(const Travel& travel, const PlanPoint& point) {
  segment_t s = blank(travel, segment_t::CURRENT, point.record_s);
  s.angle_rad = kPi / 2;  // phase a idle, b and c in series
  s.offset_A = point.tones.offset_A;
  s.n_tones = static_cast<std::int32_t>(point.tones.amplitude_A.size());
  for (std::size_t k = 0; k < point.tones.amplitude_A.size(); ++k) {
    s.tone_A[k] = point.tones.amplitude_A[k];
    s.tone_Hz[k] = point.tones.frequency_Hz[k];
  }
  s.kp_V_per_A = point.tones.kp_V_per_A;
  s.ki_V_per_As = point.tones.ki_V_per_As;
  s.period_samples = static_cast<std::int32_t>(samples_in(travel, point.tones.period_s));
  return s;
}

Profile standstill_profile(const Travel& travel, const PlanPoint& point) {
  Profile profile;
  const segment_t s = tones_segment(travel, point);
  if (point.settle_s > 0) profile.segments.push_back(blank(travel, segment_t::GATES_OFF, point.settle_s));
  profile.segments.push_back(recorded(s));
  profile.hold_at_end = false;
  return profile;
}

Profile regulated_sweep_profile(const Travel& travel, const PlanPoint& point) {
  const segment_t record = tones_segment(travel, point);
  segment_t settle = record;
  settle.duration_samples = samples_in(travel, point.settle_s);
  Profile profile;
  if (point.settle_s > 0) profile.segments.push_back(settle);
  profile.segments.push_back(recorded(record));
  profile.hold_at_end = false;
  return profile;
}

Profile locked_sweep_profile(const Travel& travel, const CheckedPoint& checked) {
  const PlanPoint& point = checked.point;
  if (point.regulated) return regulated_sweep_profile(travel, point);
  const Operating none{point.frequency_Hz, 0.0}, there{point.frequency_Hz, checked.voltage_V};
  Profile profile;
  if (point.ramp_s > 0) profile.segments.push_back(voltage(travel, point.ramp_s, none, there));
  if (point.settle_s > 0) profile.segments.push_back(voltage(travel, point.settle_s, there, there));
  profile.segments.push_back(recorded(voltage(travel, point.record_s, there, there)));
  profile.hold_at_end = false;
  return profile;
}

Profile startup_profile(const Travel& travel, const CheckedPoint& checked) {
  const PlanPoint& point = checked.point;
  const Operating there = operating_after(checked);
  Profile profile;
  if (point.before_s > 0)
    profile.segments.push_back(recorded(blank(travel, segment_t::GATES_OFF, point.before_s)));
  if (point.ramp_s > 0)
    profile.segments.push_back(recorded(voltage(travel, point.ramp_s, {0.0, travel.boost_V}, there)));
  profile.segments.push_back(recorded(voltage(travel, point.record_s, there, there)));
  return profile;
}

}  // namespace

Operating operating_before(const CheckedPoint& checked) {
  if (begins_at_rest(checked.point.kind)) return {};
  return {checked.point.frequency_Hz, checked.voltage_V};
}

Operating operating_after(const CheckedPoint& checked) {
  switch (checked.point.kind) {
    case PointKind::kDc:
    case PointKind::kStandstill:
    case PointKind::kLockedSweep:
    case PointKind::kCoastDown:
      return {};
    default:
      return {checked.point.frequency_Hz, checked.stepped_V};
  }
}

Profile record_profile(const Travel& travel, const CheckedPoint& checked) {
  const PlanPoint& point = checked.point;
  const Operating before = operating_before(checked);
  const Operating after = operating_after(checked);
  Profile profile;
  switch (point.kind) {
    case PointKind::kDc:
      profile = dc_profile(travel, point);
      break;
    case PointKind::kStandstill:
      profile = standstill_profile(travel, point);
      break;
    case PointKind::kLockedSweep:
      profile = locked_sweep_profile(travel, checked);
      break;
    case PointKind::kStartup:
      profile = startup_profile(travel, checked);
      break;
    case PointKind::kNoLoad:
    case PointKind::kSteady:
      profile.segments.push_back(recorded(voltage(travel, point.record_s, before, before)));
      break;
    case PointKind::kStep:
      if (point.before_s > 0)
        profile.segments.push_back(recorded(voltage(travel, point.before_s, before, before)));
      profile.segments.push_back(recorded(voltage(travel, point.record_s, after, after)));
      break;
    case PointKind::kCoastDown:
      if (point.before_s > 0)
        profile.segments.push_back(recorded(voltage(travel, point.before_s, before, before)));
      profile.segments.push_back(recorded(blank(travel, segment_t::GATES_OFF, point.record_s)));
      profile.hold_at_end = false;
      break;
  }
  segment_t tail =
      profile.hold_at_end ? voltage(travel, 1, after, after) : blank(travel, segment_t::GATES_OFF, 1);
  tail.duration_samples = kTail;
  profile.segments.push_back(tail);
  return profile;
}

namespace {

Action load_action(double excitation_A, double wait_s) {
  Action action;
  action.kind = ActionKind::kLoad;
  action.excitation_A = excitation_A;
  action.wait_s = wait_s;
  return action;
}

// The load of the point before comes down, in part or whole. most_slip: a motor that slipped past its
// pull-out there does not come back by itself, and would draw the current of a start as soon as the voltage
// rises.
Action unload_action(const Travel& travel, const Operating& from, double excitation_A) {
  Action action = load_action(excitation_A, travel.unload_s);
  action.most_slip = stalling_slip(travel, from.frequency_Hz);
  action.leaving = true;
  return action;
}

Action profile_action(ActionKind kind, Profile profile) {
  Action action;
  action.kind = kind;
  action.profile = std::move(profile);
  return action;
}

Action waiting(ActionKind kind, double wait_s, double bound_s) {
  Action action;
  action.kind = kind;
  action.wait_s = wait_s;
  action.bound_s = bound_s;
  return action;
}

bool small_move(const Operating& from, const Operating& to) {
  return same(from.frequency_Hz, to.frequency_Hz) &&
         std::abs(to.voltage_V - from.voltage_V) <= kLoadedMove * from.voltage_V;
}

// The lesser of both loads, since each voltage may not carry the other one's; none on a long way.
double carried_on_the_way(const Operating& from, const Operating& to, double before_A, double after_A) {
  return small_move(from, to) ? std::min(before_A, after_A) : 0.0;
}

void append(std::vector<Action>& all, std::vector<Action> more) {
  for (Action& action : more) all.push_back(std::move(action));
}

}  // namespace

std::vector<Action> actions_to_rest(const Travel& travel, const Operating& from, double excitation_A) {
  std::vector<Action> actions;
  if (excitation_A > 0) actions.push_back(unload_action(travel, from, 0.0));
  if (!resting(from)) actions.push_back(profile_action(ActionKind::kProfile, move_profile(travel, from, {})));
  actions.push_back(waiting(ActionKind::kRest, 0.0, kRestBound_s));
  return actions;
}

std::vector<Action> actions_for(const Travel& travel, const CheckedPoint& checked, const Operating& from,
                                double excitation_A) {
  const Operating there = operating_before(checked);
  std::vector<Action> actions;
  if (resting(there) || resting(from)) {
    append(actions, actions_to_rest(travel, from, excitation_A));
    excitation_A = 0.0;
  } else if (const double carried_A = carried_on_the_way(from, there, excitation_A, checked.excitation_A);
             excitation_A > carried_A) {
    actions.push_back(unload_action(travel, from, carried_A));
    excitation_A = carried_A;
  }
  if (!resting(there)) {
    if (Profile move = move_profile(travel, from, there); !move.segments.empty())
      actions.push_back(profile_action(ActionKind::kProfile, std::move(move)));
    if (checked.excitation_A != excitation_A) {
      actions.push_back(load_action(checked.excitation_A, 0.0));
      actions.back().most_slip = stalling_slip(travel, there.frequency_Hz);
    }
    actions.push_back(waiting(ActionKind::kSettle, checked.point.settle_s, checked.point.settle_bound_s));
    actions.back().most_slip = stalling_slip(travel, there.frequency_Hz);
  }
  actions.push_back(profile_action(ActionKind::kRecord, record_profile(travel, checked)));
  const bool at_speed = !resting(there) && checked.point.kind != PointKind::kCoastDown;
  if (at_speed) actions.back().most_slip = stalling_slip(travel, there.frequency_Hz);
  return actions;
}

}  // namespace imrig
