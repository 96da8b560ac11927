#include "rig/campaign/action_runner.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace imrig {

namespace {

using namespace imrig_msg;

// A load that goes down is down when this share of the way is left: torque goes with the current's square.
constexpr double kFieldLeft = 0.25;
constexpr double kFieldLeft_A = 0.05;  // what a supply may read where there is none

bridge_cmd_t bridge_command(std::int32_t action, int profile_id = 0) {
  bridge_cmd_t cmd = {};
  cmd.bridge_cmd_v1 = 1;
  cmd.action = action;
  cmd.profile_id = profile_id;
  return cmd;
}

dyno_cmd_t dyno_command(std::int32_t action, double field_A = 0.0) {
  dyno_cmd_t cmd = {};
  cmd.dyno_cmd_v1 = 1;
  cmd.action = action;
  cmd.mode = dyno_cmd_t::FIELD_CURRENT;
  cmd.value = field_A;
  cmd.ramp_per_s = std::nan("");
  return cmd;
}

Operating end_of(const Profile& profile) {
  const segment_t& last = profile.segments.back();
  if (!profile.hold_at_end || last.kind != segment_t::VOLTAGE) return {};
  return {last.frequency_end_Hz, last.amplitude_end_V};
}

}  // namespace

ActionRunner::ActionRunner(RigView& view, Outbox& out, RecordFacts facts, int first_record_number,
                           int first_profile_id, std::int64_t patience_us)
    : view_(view),
      out_(out),
      facts_(std::move(facts)),
      patience_us_(patience_us),
      record_number_(first_record_number),
      profile_id_(first_profile_id) {}

void ActionRunner::begin(std::vector<Action> actions, const CheckedPoint* point, Moment now) {
  actions_ = std::move(actions);
  point_ = point;
  action_ = 0;
  entered_ = false;
  loaded_profile_ = 0;
  stalled_ = stalled_here_ = false;
  since_us_ = now.steady_us;
}

void ActionRunner::next(Moment now) {
  ++action_;
  entered_ = false;
  since_us_ = now.steady_us;
}

std::string ActionRunner::step(Moment now) {
  while (!done()) {
    const std::size_t before = action_;
    std::string problem = run(actions_[action_], now);
    if (!problem.empty()) {
      abort_record();
      action_ = actions_.size();
      return problem;
    }
    if (action_ == before) break;
  }
  return "";
}

std::string ActionRunner::run(const Action& action, Moment now) {
  switch (action.kind) {
    case ActionKind::kLoad:
      return load(action, now);
    case ActionKind::kProfile:
      return profile(action, now);
    case ActionKind::kRest:
      return rest(action, now);
    case ActionKind::kSettle:
      return settle(action, now);
    case ActionKind::kRecord:
      return record(action, now);
  }
  return "";
}

std::string ActionRunner::late(Moment now, const char* what) const {
  return now.steady_us - since_us_ > patience_us_ ? fmt::format("{} does not get there", what) : "";
}

// Steady time without a new sample while rig time should pass.
std::string ActionRunner::stuck(Moment now) const {
  return now.steady_us - view_.watch.heard_us() > patience_us_ ? "the samples stopped" : "";
}

std::string ActionRunner::load(const Action& action, Moment now) {
  if (!entered_) {
    entered_ = true;
    since_index_ = -1;
    judged_from_ = view_.watch.next_index();
    view_.estimate.reset();
    load_from_A_ = excitation_A_;
    excitation_A_ = action.excitation_A;  // from now on the supply may have it
    to_dyno_.ask(dyno_command(dyno_cmd_t::SET, action.excitation_A));
    return "";
  }
  if (to_dyno_.busy()) return late(now, "the excitation supply");
  if (!to_dyno_.error().empty()) return "imrig-dyno: " + to_dyno_.error();
  if (std::string why = stall(action); !why.empty()) return why;
  if (since_index_ < 0) {
    const bool ordered =
        view_.dyno->at_target != 0 && std::abs(view_.dyno->target - action.excitation_A) < 1e-9;
    if (!ordered || !field_followed(action)) return late(now, "the excitation supply");
    since_index_ = view_.watch.next_index();
  }
  if (view_.watch.next_index() - since_index_ >= view_.in_samples(action.wait_s)) next(now);
  return stuck(now);
}

// The supply holds its set-point at once, the field's current falls with a time constant of its own. A supply
// that does not read its current (NaN) is believed.
bool ActionRunner::field_followed(const Action& action) const {
  const double way_A = load_from_A_ - action.excitation_A;
  const double left_A = view_.dyno->readback_A - action.excitation_A;
  return way_A <= 0 || !(left_A > std::max(kFieldLeft_A, kFieldLeft * way_A));
}

void ActionRunner::upload(const Profile& profile) {
  bridge_cmd_t cmd = bridge_command(bridge_cmd_t::UPLOAD, profile_id_++);
  cmd.at_end = bridge_cmd_t::AT_END_GATES_OFF;
  if (profile.hold_at_end) cmd.at_end = bridge_cmd_t::AT_END_HOLD;
  cmd.n_segments = static_cast<std::int32_t>(profile.segments.size());
  for (std::size_t k = 0; k < profile.segments.size(); ++k) {
    cmd.segments[k] = profile.segments[k];
    if (cmd.segments[k].record != 0) cmd.segments[k].record = record_number_;
  }
  loaded_profile_ = cmd.profile_id;
  step_ = Step::kUpload;
  to_bridge_.ask(cmd);
}

// From a profile on its way to the device to one that runs; true once it does.
bool ActionRunner::get_going(std::string& problem, Moment now) {
  if (step_ == Step::kUpload) {
    if (to_bridge_.busy()) return problem = late(now, "the upload"), false;
    if (!to_bridge_.error().empty()) return problem = "upload: " + to_bridge_.error(), false;
    step_ = Step::kStart;
    view_.watch.expect_profile(loaded_profile_);
    to_bridge_.ask(bridge_command(bridge_cmd_t::START, loaded_profile_));
    return false;
  }
  if (step_ == Step::kStart) {
    const bool runs = view_.watch.profile_start() >= 0;
    if (!runs && !to_bridge_.busy() && !to_bridge_.error().empty())
      return problem = "start: " + to_bridge_.error(), false;
    if (!runs) return problem = late(now, "the start"), false;
    to_bridge_.forget();
    step_ = Step::kRun;
  }
  return true;
}

bool ActionRunner::ran_through(const Profile& profile) const {
  return view_.watch.next_index() - view_.watch.profile_start() >= profile.total_samples();
}

std::string ActionRunner::profile(const Action& action, Moment now) {
  if (!entered_) {
    entered_ = true;
    upload(action.profile);
    return "";
  }
  std::string problem;
  if (!get_going(problem, now)) return problem;
  if (!ran_through(action.profile)) return stuck(now);
  operating_ = end_of(action.profile);
  next(now);
  return "";
}

std::string ActionRunner::rest(const Action& action, Moment now) {
  if (!entered_) {
    entered_ = true;
    operating_ = {};
    since_index_ = view_.watch.next_index();
  }
  if (view_.watch.at_rest()) {
    next(now);
    return "";
  }
  const bool too_long = view_.watch.next_index() - since_index_ > view_.in_samples(action.bound_s);
  return too_long ? "the shaft does not come to rest" : stuck(now);
}

std::string ActionRunner::stall(const Action& action) {
  const auto& estimate = view_.estimate;
  stalled_ = action.most_slip < 1.0 && estimate && estimate->valid != 0 &&
             std::abs(estimate->slip) > action.most_slip;
  stalled_here_ = stalled_ && !action.leaving;
  if (!stalled_) return "";
  return fmt::format("the motor stalled{} (slip {:.2f})", action.leaving ? " at the point before" : "",
                     estimate->slip);
}

// The record's profile travels to the device meanwhile.
std::string ActionRunner::settle(const Action& action, Moment now) {
  if (!entered_) {
    entered_ = true;
    since_index_ = judged_from_ = view_.watch.next_index();
    view_.estimate.reset();
    upload(actions_[action_ + 1].profile);
  }
  const double elapsed_s =
      static_cast<double>(view_.watch.next_index() - since_index_) * view_.sample_time_s();
  if (std::string why = stall(action); !why.empty()) return why;
  if (elapsed_s < action.wait_s) return stuck(now);
  const bool steady = view_.estimate && view_.estimate->steady != 0;
  if (!steady && elapsed_s < action.bound_s) return stuck(now);
  next(now);
  return "";
}

std::string ActionRunner::record(const Action& action, Moment now) {
  if (!entered_) {
    entered_ = true;
    const bool on_its_way = action_ > 0 && actions_[action_ - 1].kind == ActionKind::kSettle;
    if (!on_its_way) upload(action.profile);
  }
  if (step_ == Step::kUpload && !to_bridge_.busy() && to_bridge_.error().empty()) begin_record(action);
  std::string problem;
  if (!get_going(problem, now)) return problem;
  if (!ran_through(action.profile)) return stuck(now);
  if (std::string why = stall(action); !why.empty()) return why;
  return end_record(now);
}

void ActionRunner::begin_record(const Action& action) {
  expected_ = action.profile.recorded_samples();
  lost_before_ = view_.recorder ? view_.recorder->lost_blocks : 0;
  recording_ = true;
  view_.watch.expect_record(record_number_);
  out_.emit(record_message(record_t::BEGIN));
  RunnerEvent event;
  event.kind = RunnerEvent::kRecordBegun;
  event.id = point_->point.id;
  event.number = record_number_;
  out_.emit(event);
}

std::string ActionRunner::end_record(Moment now) {
  operating_ = operating_after(*point_);
  const std::int64_t missing = expected_ - view_.watch.record_samples();
  if (missing != 0 || !view_.watch.record_unbroken())
    return fmt::format("{} of {} samples are missing", missing, expected_);  // step() publishes the END
  if (view_.recorder && view_.recorder->lost_blocks != lost_before_)
    return fmt::format("the recorder lost {} blocks", view_.recorder->lost_blocks - lost_before_);
  finished_.push_back({point_->point.id, record_number_, expected_, now.steady_us});
  publish_end(record_t::COMPLETE);
  next(now);
  return "";
}

record_t ActionRunner::record_message(std::int32_t phase) {
  const CheckedPoint& p = *point_;
  const bool at_rest = p.point.kind == PointKind::kDc || p.point.kind == PointKind::kStandstill;
  const auto when_running = [at_rest](double x) { return at_rest ? std::nan("") : x; };
  record_t r = {};
  out_.stamp(r, view_.watch.utime());
  r.record_v1 = 1;
  r.phase = phase;
  r.number = record_number_;
  r.id = p.point.id;
  r.kind = point_kind_word(p.point.kind);
  r.campaign = facts_.campaign;
  r.config_hash = facts_.config_hash;
  r.plan_point = p.plan_index;
  r.pole_pairs = facts_.pole_pairs;
  r.set_frequency_Hz = when_running(p.point.frequency_Hz);
  r.set_voltage_V = when_running(p.voltage_V);
  r.set_step = p.point.kind == PointKind::kStep ? p.point.step : std::nan("");
  r.set_load_Nm = when_running(p.load_Nm);
  r.set_excitation_A = when_running(p.excitation_A);
  r.holdout = p.point.holdout ? 1 : 0;
  r.repeat_of = p.point.repeat_of;
  return r;
}

void ActionRunner::publish_end(std::int32_t status) {
  record_t r = record_message(record_t::END);
  r.status = status;
  r.samples = expected_;
  out_.emit(r);
  recording_ = false;
  ++record_number_;
}

void ActionRunner::abort_record() {
  if (recording_) publish_end(record_t::ABORTED);
}

void ActionRunner::ask_stop() {
  to_bridge_.ask(bridge_command(bridge_cmd_t::STOP));
  ask_load_off();
}

void ActionRunner::ask_load_off() {
  if (view_.needs_dyno) to_dyno_.ask(dyno_command(dyno_cmd_t::OFF));
}

void ActionRunner::ask_reset() {
  operating_ = {};
  excitation_A_ = 0.0;
  to_bridge_.ask(bridge_command(bridge_cmd_t::RESET));
  if (view_.needs_dyno) to_dyno_.ask(dyno_command(dyno_cmd_t::RESET));
}

const std::string& ActionRunner::refusal() const {
  return to_bridge_.error().empty() ? to_dyno_.error() : to_bridge_.error();
}

void ActionRunner::forget_commands() {
  to_bridge_.forget();
  to_dyno_.forget();
}

void ActionRunner::send(LeaseClient& bridge, LeaseClient& dyno, Moment now) {
  if (bridge.held())
    if (auto cmd = to_bridge_.step(bridge, now)) out_.emit(*cmd);
  if (dyno.held())
    if (auto cmd = to_dyno_.step(dyno, now)) out_.emit(*cmd);
}

void ActionRunner::recover() {
  forget_commands();
  if (view_.bridge->run_state == bridge_status_t::HOLDING && operating_.voltage_V > 0 && !stalled_) return;
  operating_ = {};
  to_bridge_.ask(bridge_command(bridge_cmd_t::STOP));
}

}  // namespace imrig
