#include "rig/campaign/runner.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "rig/base/space_vector.h"
#include "rig/campaign/sample_watch.h"
#include "rig/safety/command_result.h"
#include "rig/safety/trip.h"

namespace imrig {

namespace {

using namespace imrig_msg;

constexpr std::int64_t kHeartbeat_us = 200'000;
constexpr std::int64_t kStatus_us = 500'000;
constexpr std::int64_t kAnswer_us = 1'500'000;   // wall time until a command is repeated
constexpr std::int64_t kBusyPause_us = 50'000;
constexpr std::int64_t kStatusSilence_us = 3'000'000;
constexpr std::int64_t kConfirm_us = 10'000'000;  // the recorder's word that a record is on disk
constexpr std::int64_t kStop_us = 8'000'000;
constexpr int kTries = 6;                         // of one command
constexpr int kFailedInRow = 3;
constexpr double kZeros_s = 0.3;                  // gates off at rest before anything moves: the sensors' zeros
constexpr double kStalledSlip = 0.5;

// Refusals that are worth another try.
bool passing(CommandResult result) {
  return result == CommandResult::kBusy || result == CommandResult::kStale || result == CommandResult::kNotNew;
}

std::string refusal(std::int32_t result) {
  const auto known = static_cast<CommandResult>(result);
  if (result >= 100) return fmt::format("refused by the device (code {})", result - 100);
  return std::string(result_name(known));
}

// A command on its way to bridge or dyno.
template <class Command, class Status>
struct Exchange {
  std::optional<Command> wanted;   // what is to be carried out
  std::int64_t sent_us = -1;
  std::int64_t not_before_us = 0;
  int tries = 0;
  std::string error;

  void ask(const Command& command) {
    *this = Exchange{};
    wanted = command;
  }
  bool busy() const { return wanted.has_value(); }

  // What to publish now, if anything.
  std::optional<Command> step(LeaseClient& lease, Moment now) {
    if (!wanted || now.steady_us < not_before_us) return std::nullopt;
    if (sent_us >= 0 && now.steady_us - sent_us < kAnswer_us) return std::nullopt;
    if (tries >= kTries) {
      if (error.empty()) error = "no answer";
      wanted.reset();
      return std::nullopt;
    }
    ++tries;
    sent_us = now.steady_us;
    lease.sign(*wanted, now);
    return wanted;
  }

  void answer(const Status& status, Moment now) {
    if (!wanted || sent_us < 0) return;
    if (status.last_cmd_epoch != wanted->lease_epoch || status.last_cmd_seq != wanted->seq) return;
    const auto result = static_cast<CommandResult>(status.last_cmd_result);
    if (result == CommandResult::kPending) return;
    if (result == CommandResult::kDone) {
      *this = Exchange{};
    } else if (passing(result) && tries < kTries) {
      error = refusal(status.last_cmd_result);
      sent_us = -1;
      not_before_us = now.steady_us + kBusyPause_us;
    } else {
      error = refusal(status.last_cmd_result);
      wanted.reset();
    }
  }
};

}  // namespace

struct Runner::State {
  enum class Phase { kConnect, kLease, kZeros, kPoints, kToRest, kConfirm, kStopping, kRelease, kEnd };
  enum class Step { kUpload, kStart, kRun };

  explicit State(RunnerConfig config)
      : c(std::move(config)),
        bridge_lease(heartbeat_t::BRIDGE, c.holder, std::int64_t{1000} * c.rig.limits.lease_ms),
        dyno_lease(heartbeat_t::DYNO, c.holder, std::int64_t{1000} * c.rig.limits.lease_ms) {
    needs_dyno = std::any_of(c.points.begin(), c.points.end(), [](const CheckedPoint& p) { return p.excitation_A > 0; });
    record_number = c.first_record_number;
    profile_id = c.profile_base;
    done = c.points_total - static_cast<int>(c.points.size());
    campaign_state = campaign_status_t::RUNNING;
  }

  RunnerConfig c;
  LeaseClient bridge_lease;
  LeaseClient dyno_lease;
  bool needs_dyno = false;

  Phase phase = Phase::kConnect;
  std::int64_t phase_since_us = -1;
  RunnerEnd end = RunnerEnd::kRunning;
  RunnerEnd end_wanted = RunnerEnd::kDone;
  std::string reason;
  std::string stop_wanted;

  std::optional<bridge_status_t> bridge;
  std::optional<dyno_status_t> dyno;
  std::int64_t bridge_heard_us = 0;
  std::int64_t dyno_heard_us = 0;
  std::optional<ack_t> recorder;
  std::int64_t recorder_heard_us = 0;
  std::optional<estimate_t> estimate;
  SampleWatch watch;

  Exchange<bridge_cmd_t, bridge_status_t> to_bridge;
  Exchange<dyno_cmd_t, dyno_status_t> to_dyno;

  Travel travel;
  std::size_t point = 0;  // index in c.points
  std::vector<Action> actions;
  std::size_t action = 0;
  bool entered = false;             // the running action has been begun
  Step step = Step::kUpload;
  std::int64_t action_since_us = 0;
  std::int64_t action_index = 0;    // sample index at which the waiting part began
  int loaded_profile = 0;           // uploaded ahead
  int attempt = 1;
  int failed_in_row = 0;
  Operating operating;
  double excitation_A = 0.0;
  bool recording = false;
  std::int64_t expected = 0;
  std::int64_t recorder_lost_before = 0;

  struct Unconfirmed {
    std::string id;
    int number;
    std::int64_t samples;
    std::int64_t since_us;
  };
  std::deque<Unconfirmed> unconfirmed;

  int record_number = 1;
  int profile_id = 1;
  int done = 0;
  int failed = 0;
  std::int32_t campaign_state = 0;
  std::int64_t seq = 0;
  std::int64_t heartbeat_due_us = 0;
  std::int64_t status_due_us = 0;
  std::vector<RunnerOutput> out;

  double sample_time_s() const { return 1e-9 * static_cast<double>(watch.sample_time_ns()); }
  std::int64_t in_samples(double seconds) const { return std::llround(seconds / sample_time_s()); }
  const CheckedPoint& current() const { return c.points[point]; }

  template <class Message>
  void stamp(Message& message) {
    message.utime = watch.utime();
    message.seq = ++seq;
  }
  template <class Message>
  void emit(Message message) {
    out.emplace_back(std::move(message));
  }

  void enter(Phase next, Moment now) {
    phase = next;
    phase_since_us = now.steady_us;
  }

  // ---- ends ---------------------------------------------------------------------------------------------

  void abandon(RunnerEnd how, const std::string& why, Moment now) {
    if (phase == Phase::kStopping || phase == Phase::kRelease || phase == Phase::kEnd) return;
    end_wanted = how;
    reason = why;
    abort_record();
    ask_stop();
    enter(Phase::kStopping, now);
  }

  void ask_stop() {
    if (bridge_lease.held()) {
      bridge_cmd_t stop = {};
      stop.bridge_cmd_v1 = 1;
      stop.action = bridge_cmd_t::STOP;
      to_bridge.ask(stop);
    }
    if (dyno_lease.held()) {
      dyno_cmd_t off = blank_dyno(dyno_cmd_t::OFF);
      to_dyno.ask(off);
    }
  }

  static dyno_cmd_t blank_dyno(std::int32_t action) {
    dyno_cmd_t cmd = {};
    cmd.dyno_cmd_v1 = 1;
    cmd.action = action;
    cmd.mode = dyno_cmd_t::FIELD_CURRENT;
    cmd.ramp_per_s = std::nan("");
    return cmd;
  }

  // Trips, silence, lost leases: whatever phase it is.
  void check_health(Moment now) {
    if (phase == Phase::kConnect || phase == Phase::kStopping || phase == Phase::kRelease || phase == Phase::kEnd) return;
    if (const std::int32_t trip = tripped(); trip != 0)
      return abandon(RunnerEnd::kTripped, fmt::format("the rig tripped: {}", trip_name(static_cast<Trip>(trip))), now);
    if (!stop_wanted.empty()) return abandon(RunnerEnd::kStopped, stop_wanted, now);
    if (now.steady_us - bridge_heard_us > kStatusSilence_us) return abandon(RunnerEnd::kFailed, "imrig-bridge is silent", now);
    if (needs_dyno && now.steady_us - dyno_heard_us > kStatusSilence_us)
      return abandon(RunnerEnd::kFailed, "imrig-dyno is silent", now);
    if (c.needs_recorder && now.steady_us - recorder_heard_us > kConfirm_us)
      return abandon(RunnerEnd::kFailed, "imrig-recorder is silent", now);
    if (bridge->link_state != bridge_status_t::LINK_UP) return abandon(RunnerEnd::kFailed, "the DSP link is down", now);
    if (needs_dyno && dyno->link_state == dyno_status_t::LINK_ABSENT)
      return abandon(RunnerEnd::kFailed, "the excitation supply is gone", now);
    if (bridge_lease.lost()) return abandon(RunnerEnd::kFailed, "the lease of imrig-bridge was lost", now);
    if (dyno_lease.lost()) return abandon(RunnerEnd::kFailed, "the lease of imrig-dyno was lost", now);
    if (watch.rebooted()) return abandon(RunnerEnd::kFailed, "the DSP restarted", now);
  }

  // First cause: a side that only followed the other one tells less.
  std::int32_t tripped() const {
    const std::int32_t b = bridge ? bridge->trip : 0;
    const std::int32_t d = dyno ? dyno->trip : 0;
    const auto follows = [](std::int32_t trip) { return trip == static_cast<std::int32_t>(Trip::kPeerTripped); };
    if (b != 0 && !(follows(b) && d != 0)) return b;
    return d;
  }

  // ---- start --------------------------------------------------------------------------------------------

  void connect(Moment now) {
    if (!stop_wanted.empty()) return finish(RunnerEnd::kStopped, stop_wanted, now);
    const char* missing = nullptr;
    if (!bridge) {
      missing = "imrig-bridge does not answer on the bus; start the rig with imrig up";
    } else if (bridge->link_state != bridge_status_t::LINK_UP || !watch.seen()) {
      missing = "no DSP answers the bridge";
    } else if (needs_dyno && !dyno) {
      missing = "imrig-dyno does not answer on the bus; start the rig with imrig up";
    } else if (needs_dyno && dyno->link_state != dyno_status_t::LINK_UP) {
      missing = "no excitation supply answers imrig-dyno";
    } else if (c.needs_recorder && !recorder) {
      missing = "imrig-recorder does not acknowledge samples";
    }
    if (missing == nullptr) {
      if (const std::int32_t trip = tripped(); trip != 0)
        return finish(RunnerEnd::kFailed,
                      fmt::format("the rig stands tripped ({}); find the cause, then imrig reset", trip_name(static_cast<Trip>(trip))),
                      now);
      if (bridge->run_state != bridge_status_t::IDLE) return finish(RunnerEnd::kFailed, "the motor is already being driven", now);
      bridge_lease.acquire();
      if (needs_dyno) dyno_lease.acquire();
      return enter(Phase::kLease, now);
    }
    if (now.steady_us - phase_since_us > c.patience_us) finish(RunnerEnd::kFailed, missing, now);
  }

  void lease(Moment now) {
    if (bridge_lease.held() && (!needs_dyno || dyno_lease.held())) {
      publish_dataset();
      travel = travel_of(c.plan, c.rig, sample_time_s());
      action_index = watch.next_index();
      return enter(Phase::kZeros, now);
    }
    if (now.steady_us - phase_since_us > c.patience_us) {
      const bool taken = bridge_lease.other_holder() != 0 || dyno_lease.other_holder() != 0;
      abandon(RunnerEnd::kFailed, taken ? "somebody else commands the rig" : "no command lease was granted", now);
    }
  }

  void publish_dataset() {
    dataset_t d = {};
    stamp(d);
    d.dataset_v1 = 1;
    d.name = c.plan.name;
    d.pole_pairs = c.rig.motor.pole_pairs;
    d.noise_current_A = d.noise_voltage_V = d.noise_speed_rad_s = d.noise_torque_Nm = d.noise_power_W = std::nan("");
    d.accuracy_current_gain = c.rig.accuracy.current_gain;
    d.accuracy_voltage_gain = c.rig.accuracy.voltage_gain;
    emit(d);
  }

  void zeros(Moment now) {
    if (watch.next_index() - action_index < in_samples(kZeros_s)) return;
    enter(Phase::kPoints, now);
    begin_point(now);
  }

  // ---- points -------------------------------------------------------------------------------------------

  void begin_point(Moment now) {
    if (point >= c.points.size()) {
      begin_actions(actions_to_rest(travel, operating, excitation_A), now);
      return enter(Phase::kToRest, now);
    }
    begin_actions(actions_for(travel, current(), operating, excitation_A), now);
  }

  void begin_actions(std::vector<Action> list, Moment now) {
    actions = std::move(list);
    action = 0;
    entered = false;
    loaded_profile = 0;
    action_since_us = now.steady_us;
  }

  void next_action(Moment now) {
    ++action;
    entered = false;
    action_since_us = now.steady_us;
  }

  void run_actions(Moment now) {
    while (action < actions.size()) {
      const std::size_t before = action;
      const std::string problem = run_action(actions[action], now);
      if (!problem.empty()) return attempt_failed(problem, now);
      if (phase == Phase::kStopping || action == before) return;
    }
    actions_done(now);
  }

  void actions_done(Moment now) {
    if (phase == Phase::kToRest) return enter(Phase::kConfirm, now);
    ++point;
    attempt = 1;
    failed_in_row = 0;
    begin_point(now);
  }

  // Empty: fine so far.
  std::string run_action(const Action& a, Moment now) {
    switch (a.kind) {
      case ActionKind::kLoad: return load(a, now);
      case ActionKind::kProfile: return profile(a, now);
      case ActionKind::kRest: return rest(a, now);
      case ActionKind::kSettle: return settle(a, now);
      case ActionKind::kRecord: return record(a, now);
    }
    return "";
  }

  std::string load(const Action& a, Moment now) {
    if (!entered) {
      entered = true;
      action_index = -1;
      dyno_cmd_t set = blank_dyno(dyno_cmd_t::SET);
      set.value = a.excitation_A;
      to_dyno.ask(set);
      return "";
    }
    if (to_dyno.busy()) return timed_out(now, "the excitation supply");
    if (!to_dyno.error.empty()) return "imrig-dyno: " + to_dyno.error;
    if (action_index < 0) {
      if (dyno->at_target == 0 || std::abs(dyno->target - a.excitation_A) > 1e-9) return timed_out(now, "the excitation supply");
      excitation_A = a.excitation_A;
      action_index = watch.next_index();
    }
    if (watch.next_index() - action_index >= in_samples(a.wait_s)) next_action(now);
    return "";
  }

  std::string timed_out(Moment now, const char* what) const {
    return now.steady_us - action_since_us > c.patience_us ? std::string(what) + " does not get there" : "";
  }

  // Uploads and starts a profile; true once it runs.
  bool get_going(const Profile& profile, std::string& problem, Moment now) {
    if (step == Step::kUpload) {
      if (loaded_profile == 0) {
        upload(profile, 0);
        return false;
      }
      if (to_bridge.busy()) return problem = timed_out(now, "the upload"), false;
      if (!to_bridge.error.empty()) return problem = "upload: " + to_bridge.error, false;
      step = Step::kStart;
      bridge_cmd_t start = {};
      start.bridge_cmd_v1 = 1;
      start.action = bridge_cmd_t::START;
      start.profile_id = loaded_profile;
      watch.expect_profile(loaded_profile);
      to_bridge.ask(start);
      return false;
    }
    if (step == Step::kStart) {
      const bool runs = watch.profile_start() >= 0 || bridge->profile_id == loaded_profile;
      if (to_bridge.busy() && !runs) return problem = timed_out(now, "the start"), false;
      if (!to_bridge.error.empty() && !runs) return problem = "start: " + to_bridge.error, false;
      to_bridge = {};
      step = Step::kRun;
    }
    return true;
  }

  void upload(const Profile& profile, int record) {
    bridge_cmd_t cmd = {};
    cmd.bridge_cmd_v1 = 1;
    cmd.action = bridge_cmd_t::UPLOAD;
    cmd.profile_id = loaded_profile = profile_id++;
    cmd.at_end = bridge_cmd_t::AT_END_GATES_OFF;
    if (profile.hold_at_end) cmd.at_end = bridge_cmd_t::AT_END_HOLD;
    cmd.n_segments = static_cast<std::int32_t>(profile.segments.size());
    for (std::size_t k = 0; k < profile.segments.size(); ++k) {
      cmd.segments[k] = profile.segments[k];
      if (cmd.segments[k].record != 0) cmd.segments[k].record = record;
    }
    to_bridge.ask(cmd);
  }

  // Wall time without a new sample while a profile runs.
  std::string stuck(Moment now) const {
    return now.steady_us - watch.heard_us() > c.patience_us ? "the samples stopped" : "";
  }

  std::string profile(const Action& a, Moment now) {
    if (!entered) {
      entered = true;
      step = Step::kUpload;
      loaded_profile = 0;
    }
    std::string problem;
    if (!get_going(a.profile, problem, now)) return problem;
    const std::int64_t start = watch.profile_start();
    if (start < 0 || watch.next_index() - start < a.profile.total_samples()) return stuck(now);
    loaded_profile = 0;
    operating = end_of(a.profile);
    next_action(now);
    return "";
  }

  static Operating end_of(const Profile& profile) {
    const segment_t& last = profile.segments.back();
    if (!profile.hold_at_end || last.kind != segment_t::VOLTAGE) return {};
    return {last.frequency_end_Hz, last.amplitude_end_V};
  }

  std::string rest(const Action& a, Moment now) {
    if (!entered) {
      entered = true;
      action_index = watch.next_index();
    }
    operating = {};
    if (watch.at_rest()) {
      next_action(now);
    } else if (watch.next_index() - action_index > in_samples(a.bound_s)) {
      return "the shaft does not come to rest";
    }
    return stuck(now);
  }

  std::string settle(const Action& a, Moment now) {
    if (!entered) {
      entered = true;
      action_index = watch.next_index();
      estimate.reset();
      step = Step::kUpload;
      upload(actions[action + 1].profile, record_number);
    }
    const double elapsed_s = static_cast<double>(watch.next_index() - action_index) * sample_time_s();
    if (elapsed_s < a.wait_s) return stuck(now);
    if (estimate && estimate->valid != 0 && std::abs(estimate->slip) > kStalledSlip && !(elapsed_s < a.bound_s))
      return fmt::format("the motor stalled (slip {:.2f})", estimate->slip);
    const bool steady = estimate && estimate->steady != 0;
    if (steady || elapsed_s >= a.bound_s) {
      next_action(now);
      return "";
    }
    return stuck(now);
  }

  // ---- records ------------------------------------------------------------------------------------------

  std::string record(const Action& a, Moment now) {
    if (!entered) {
      entered = true;
      step = Step::kUpload;
      if (loaded_profile == 0) upload(a.profile, record_number);
    }
    if (step == Step::kUpload && !to_bridge.busy() && to_bridge.error.empty() && !recording) begin_record(a);
    std::string problem;
    if (!get_going(a.profile, problem, now)) return problem;
    const std::int64_t start = watch.profile_start();
    if (start < 0 || watch.next_index() - start < a.profile.total_samples()) return stuck(now);
    return end_record(now);
  }

  record_t record_message(std::int32_t phase_of) {
    const CheckedPoint& p = current();
    const bool rest_kind = p.point.kind == PointKind::kDc || p.point.kind == PointKind::kStandstill;
    record_t r = {};
    stamp(r);
    r.record_v1 = 1;
    r.phase = phase_of;
    r.number = record_number;
    r.id = p.point.id;
    r.kind = point_kind_word(p.point.kind);
    r.campaign = c.plan.name;
    r.config_hash = c.config_hash;
    r.plan_point = p.plan_index;
    r.pole_pairs = c.rig.motor.pole_pairs;
    r.set_frequency_Hz = rest_kind ? std::nan("") : p.point.frequency_Hz;
    r.set_voltage_V = rest_kind ? std::nan("") : p.voltage_V;
    r.set_step = p.point.kind == PointKind::kStep ? p.point.step : std::nan("");
    r.set_load_Nm = rest_kind ? std::nan("") : p.load_Nm;
    r.set_excitation_A = rest_kind ? std::nan("") : p.excitation_A;
    r.holdout = p.point.holdout ? 1 : 0;
    r.repeat_of = p.point.repeat_of;
    return r;
  }

  void begin_record(const Action& a) {
    expected = a.profile.recorded_samples();
    recording = true;
    watch.expect_record(record_number);
    recorder_lost_before = recorder ? recorder->lost_blocks : 0;
    emit(record_message(record_t::BEGIN));
    RunnerEvent event;
    event.kind = RunnerEvent::kRecordBegun;
    event.id = current().point.id;
    event.number = record_number;
    emit(event);
  }

  void publish_end(std::int32_t status) {
    record_t r = record_message(record_t::END);
    r.status = status;
    r.samples = expected;
    emit(r);
    recording = false;
    ++record_number;
    loaded_profile = 0;
  }

  std::string end_record(Moment now) {
    operating = operating_after(current());
    const bool whole = watch.record_samples() == expected && watch.record_unbroken();
    if (!whole) {
      const std::int64_t got = watch.record_samples();
      publish_end(record_t::ABORTED);
      return fmt::format("{} of {} samples are missing", expected - got, expected);
    }
    unconfirmed.push_back({current().point.id, record_number, expected, now.steady_us});
    publish_end(record_t::COMPLETE);
    next_action(now);
    return "";
  }

  void abort_record() {
    if (recording) publish_end(record_t::ABORTED);
  }

  // A point is done once the recorder says that its record's end is on disk.
  void confirm(Moment now) {
    while (!unconfirmed.empty()) {
      const Unconfirmed& u = unconfirmed.front();
      const bool on_disk = !c.needs_recorder || is_on_disk(u);
      if (!on_disk) {
        if (now.steady_us - u.since_us > kConfirm_us)
          abandon(RunnerEnd::kFailed, fmt::format("imrig-recorder does not confirm record {}", u.id), now);
        return;
      }
      RunnerEvent event;
      event.kind = RunnerEvent::kPointDone;
      event.id = u.id;
      event.number = u.number;
      event.samples = u.samples;
      emit(event);
      ++done;
      unconfirmed.pop_front();
    }
  }

  bool is_on_disk(const Unconfirmed& u) const {
    return recorder && recorder->boot_id == watch.boot_id() && recorder->flushed_record >= u.number;
  }

  void attempt_failed(const std::string& why, Moment now) {
    abort_record();
    if (phase == Phase::kToRest) return abandon(RunnerEnd::kFailed, why, now);
    RunnerEvent event;
    event.id = current().point.id;
    event.attempt = attempt;
    event.text = why;
    event.kind = attempt <= c.retries ? RunnerEvent::kPointRetried : RunnerEvent::kPointFailed;
    emit(event);
    if (attempt <= c.retries) {
      ++attempt;
    } else {
      ++failed;
      if (++failed_in_row >= kFailedInRow)
        return abandon(RunnerEnd::kFailed, fmt::format("{} points in a row failed; the last one, {}: {}", failed_in_row, event.id, why),
                       now);
      ++point;
      attempt = 1;
    }
    to_bridge = {};
    to_dyno = {};
    recover(now);
  }

  // Where the inverter's state is known, go on from there; else stop and begin from rest.
  void recover(Moment now) {
    const bool known = bridge->run_state == bridge_status_t::HOLDING && watch.profile_start() >= 0 && operating.voltage_V > 0;
    if (known) return begin_point(now);
    bridge_cmd_t stop = {};
    stop.bridge_cmd_v1 = 1;
    stop.action = bridge_cmd_t::STOP;
    to_bridge.ask(stop);
    operating = {};
    begin_point(now);
  }

  // ---- stop and release ---------------------------------------------------------------------------------

  void finish(RunnerEnd how, const std::string& why, Moment now) {
    end_wanted = how;
    reason = why;
    enter(Phase::kRelease, now);
  }

  void stopping(Moment now) {
    const bool motor_off = !bridge || bridge->run_state == bridge_status_t::IDLE || bridge->run_state == bridge_status_t::TRIPPED;
    const bool load_off = !dyno || dyno->run_state != dyno_status_t::ON;
    const bool late = now.steady_us - phase_since_us > kStop_us;
    if ((motor_off && load_off && !to_bridge.busy() && !to_dyno.busy()) || late) enter(Phase::kRelease, now);
  }

  void to_confirm(Moment now) {
    if (!unconfirmed.empty()) return;
    if (dyno_lease.held() && !to_dyno.busy() && dyno->run_state == dyno_status_t::ON) to_dyno.ask(blank_dyno(dyno_cmd_t::OFF));
    if (to_dyno.busy()) return;
    const bool all = failed == 0;
    finish(all ? RunnerEnd::kDone : RunnerEnd::kFailed, all ? "" : fmt::format("{} points could not be taken", failed), now);
  }

  void release(Moment now) {
    bridge_lease.release();
    dyno_lease.release();
    lease_commands(now);
    end = end_wanted;
    campaign_state = campaign_status_t::FAILED;
    if (end == RunnerEnd::kDone) campaign_state = campaign_status_t::DONE;
    if (end == RunnerEnd::kStopped) campaign_state = campaign_status_t::STOPPED;
    RunnerEvent event;
    event.kind = RunnerEvent::kEnded;
    event.text = reason;
    emit(event);
    publish_status();
    phase = Phase::kEnd;
  }

  // ---- every step ---------------------------------------------------------------------------------------

  void lease_commands(Moment now) {
    if (auto cmd = bridge_lease.step(now)) emit(*cmd);
    if (needs_dyno)
      if (auto cmd = dyno_lease.step(now)) emit(*cmd);
  }

  void publish_status() {
    campaign_status_t s = {};
    stamp(s);
    s.campaign_status_v1 = 1;
    s.state = campaign_state;
    s.point = static_cast<std::int32_t>(point);
    s.points_done = done;
    s.points_total = c.points_total;
    s.trip = end_wanted == RunnerEnd::kTripped ? tripped() : 0;
    s.plan = c.plan.name;
    s.point_id = point < c.points.size() ? current().point.id : "";
    emit(s);
  }

  void publish_heartbeat(Moment now) {
    heartbeat_t h = {};
    stamp(h);
    h.heartbeat_v1 = 1;
    h.host_utime = now.wall_us;
    h.instance = c.instance;
    h.process = heartbeat_t::CAMPAIGN;
    h.pid = c.pid;
    h.state = heartbeat_t::OK;
    if (phase == Phase::kStopping || phase == Phase::kRelease) h.state = heartbeat_t::STOPPING;
    emit(h);
  }

  void periodic(Moment now) {
    lease_commands(now);
    if (now.steady_us >= heartbeat_due_us) {
      heartbeat_due_us = now.steady_us + kHeartbeat_us;
      publish_heartbeat(now);
    }
    if (now.steady_us >= status_due_us) {
      status_due_us = now.steady_us + kStatus_us;
      publish_status();
    }
    if (auto read = watch.acknowledge(now.steady_us)) {
      ack_t ack = {};
      stamp(ack);
      ack.ack_v1 = 1;
      ack.boot_id = watch.boot_id();
      ack.read_index = *read;
      ack.lost_blocks = watch.lost_blocks();
      ack.process = heartbeat_t::CAMPAIGN;
      emit(ack);
    }
  }

  void advance(Moment now) {
    check_health(now);
    switch (phase) {
      case Phase::kConnect: return connect(now);
      case Phase::kLease: return lease(now);
      case Phase::kZeros: return zeros(now);
      case Phase::kPoints:
      case Phase::kToRest: return run_actions(now);
      case Phase::kConfirm: return to_confirm(now);
      case Phase::kStopping: return stopping(now);
      case Phase::kRelease: return release(now);
      case Phase::kEnd: return;
    }
  }

  std::vector<RunnerOutput> run(Moment now) {
    if (phase == Phase::kEnd) return {};
    if (phase_since_us < 0) phase_since_us = now.steady_us;
    advance(now);
    confirm(now);
    if (auto cmd = to_bridge.step(bridge_lease, now)) emit(*cmd);
    if (auto cmd = to_dyno.step(dyno_lease, now)) emit(*cmd);
    periodic(now);
    return std::exchange(out, {});
  }
};

const char* end_word(RunnerEnd end) {
  switch (end) {
    case RunnerEnd::kDone: return "done";
    case RunnerEnd::kStopped: return "stopped";
    case RunnerEnd::kTripped: return "tripped";
    case RunnerEnd::kFailed: return "failed";
    case RunnerEnd::kRunning: return "running";
  }
  return "";
}

Runner::Runner(RunnerConfig config) : s_(std::make_unique<State>(std::move(config))) {}
Runner::~Runner() = default;

void Runner::on(const bridge_status_t& message, Moment now) {
  s_->bridge = message;
  s_->bridge_heard_us = now.steady_us;
  s_->to_bridge.answer(message, now);
}

void Runner::on(const dyno_status_t& message, Moment now) {
  s_->dyno = message;
  s_->dyno_heard_us = now.steady_us;
  s_->to_dyno.answer(message, now);
}

void Runner::on(const samples_t& message, Moment now) { s_->watch.on(message, now.steady_us); }

void Runner::on(const estimate_t& message, Moment) {
  if (message.boot_id == s_->watch.boot_id() && message.first_index >= s_->action_index) s_->estimate = message;
}

void Runner::on(const lease_t& message, Moment now) {
  if (message.authority == heartbeat_t::BRIDGE) s_->bridge_lease.on_lease(message, now);
  if (message.authority == heartbeat_t::DYNO) s_->dyno_lease.on_lease(message, now);
}

void Runner::on(const ack_t& message, Moment now) {
  if (message.process != heartbeat_t::RECORDER) return;
  s_->recorder = message;
  s_->recorder_heard_us = now.steady_us;
}

void Runner::request_stop(const std::string& why) { s_->stop_wanted = why; }
void Runner::fail(const std::string& why, Moment now) {
  if (s_->phase == State::Phase::kConnect) return s_->finish(RunnerEnd::kFailed, why, now);
  s_->abandon(RunnerEnd::kFailed, why, now);
}
std::vector<RunnerOutput> Runner::step(Moment now) { return s_->run(now); }
RunnerEnd Runner::end() const { return s_->end; }
std::string Runner::end_reason() const { return s_->reason; }
int Runner::points_done() const { return s_->done; }
std::int64_t Runner::lost_blocks() const { return s_->watch.lost_blocks(); }
int Runner::points_failed() const { return s_->failed; }
std::string Runner::point_id() const { return s_->point < s_->c.points.size() ? s_->current().point.id : ""; }

}  // namespace imrig
