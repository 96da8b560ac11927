#include "rig/campaign/runner.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "rig/campaign/action_runner.h"
#include "rig/campaign/runner_messages.h"
#include "rig/safety/trip.h"

namespace imrig {

namespace {

using namespace imrig_msg;

constexpr std::int64_t kHeartbeat_us = 200'000;
constexpr std::int64_t kStatus_us = 500'000;
constexpr std::int64_t kConfirm_us =
    10'000'000;  // until the recorder must have said that a record is on disk
constexpr std::int64_t kStop_us =
    12'000'000;  // until a stop is given up and the leases are let go, which stops too
constexpr std::int64_t kUsualStatus_us = 500'000;  // a status comes ten times as often
constexpr int kFailedInRow = 3;
constexpr double kZeros_s = 0.3;
constexpr double kCoast_s = 2.0;  // rig time from a trip to its reset: currents and excitation die out

std::string trip_word(std::int32_t trip) { return std::string(trip_name(static_cast<Trip>(trip))); }

}  // namespace

struct Runner::State {
  enum class Phase {
    kConnect,
    kLease,
    kZeros,
    kPoints,
    kTripped,
    kRest,
    kConfirm,
    kStopping,
    kRelease,
    kEnd
  };

  explicit State(RunnerConfig config)
      : c(std::move(config)),
        bridge_lease(heartbeat_t::BRIDGE, c.holder, std::int64_t{1000} * c.rig.limits.lease_ms),
        dyno_lease(heartbeat_t::DYNO, c.holder, std::int64_t{1000} * c.rig.limits.lease_ms),
        actions(view, out, {c.plan.name, c.config_hash, c.rig.motor.pole_pairs}, c.first_record_number,
                c.first_profile_id, c.patience_us) {
    view.needs_dyno = std::any_of(c.points.begin(), c.points.end(),
                                  [](const CheckedPoint& p) { return p.excitation_A > 0; });
    view.needs_recorder = c.needs_recorder;
    tally.total = c.points_total;
    tally.done = c.points_total - static_cast<int>(c.points.size());
  }

  RunnerConfig c;
  RigView view;
  Outbox out;
  LeaseClient bridge_lease;
  LeaseClient dyno_lease;
  ActionRunner actions;
  Travel travel;

  Phase phase = Phase::kConnect;
  std::int64_t phase_since_us = -1;
  std::int64_t zeros_since = 0;
  bool connected = false;
  RunnerEnd end = RunnerEnd::kRunning;
  RunnerEnd end_wanted = RunnerEnd::kDone;
  std::string reason;
  std::string stop_wanted;
  std::int32_t trip = 0;

  std::size_t point = 0;  // index in c.points
  int attempt = 1;
  Tally tally;
  std::int64_t tripped_at = 0;  // sample index
  bool reset_asked = false;
  std::int32_t campaign_state = campaign_status_t::RUNNING;
  std::int64_t heartbeat_due_us = 0;
  std::int64_t status_due_us = 0;

  template <class Message>
  void send(Message message) {
    out.stamp(message, view.watch.utime());
    out.emit(std::move(message));
  }

  void enter(Phase next, Moment now) {
    phase = next;
    phase_since_us = now.steady_us;
  }
  std::int64_t waited_us(Moment now) const { return now.steady_us - phase_since_us; }
  bool ending() const {
    return phase == Phase::kStopping || phase == Phase::kRelease || phase == Phase::kEnd;
  }

  // ---- ends ---------------------------------------------------------------------------------------------

  // The rig was not touched, or rests already.
  void finish(RunnerEnd how, const std::string& why, Moment now) {
    end_wanted = how;
    reason = why;
    enter(Phase::kRelease, now);
  }

  // Whatever is going on.
  void abandon(RunnerEnd how, const std::string& why, Moment now) {
    if (ending()) return;
    if (phase == Phase::kConnect) return finish(how, why, now);
    end_wanted = how;
    reason = why;
    actions.abort_record();
    actions.ask_stop();
    enter(Phase::kStopping, now);
  }

  void check_health(Moment now) {
    if (ending()) return;
    if (!stop_wanted.empty()) return abandon(RunnerEnd::kStopped, stop_wanted, now);
    if (phase == Phase::kConnect) return;
    if (trip = view.trip(); trip != 0 && phase != Phase::kTripped) {
      if (!may_go_on()) return abandon(RunnerEnd::kTripped, "the rig tripped: " + trip_word(trip), now);
      point_tripped(now);
    }
    if (const std::string why = view.failed(now.steady_us); !why.empty())
      return abandon(RunnerEnd::kFailed, why, now);
    if (bridge_lease.lost()) return lease_lost("imrig-bridge", view.bridge_us, now);
    if (dyno_lease.lost()) return lease_lost("imrig-dyno", view.dyno_us, now);
  }

  // A dead process loses its lease first; that it is dead says more.
  void lease_lost(const char* who, std::int64_t heard_us, Moment now) {
    const bool dead = now.steady_us - heard_us > kUsualStatus_us;
    abandon(RunnerEnd::kFailed,
            dead ? fmt::format("{} is silent", who) : fmt::format("the command lease of {} was lost", who),
            now);
  }

  // ---- start --------------------------------------------------------------------------------------------

  void connect(Moment now) {
    if (const std::string missing = view.missing(); !missing.empty()) {
      if (waited_us(now) > c.patience_us) finish(RunnerEnd::kFailed, missing, now);
      return;
    }
    if (const std::int32_t stands = view.trip(); stands != 0)
      return finish(
          RunnerEnd::kFailed,
          fmt::format("the rig stands tripped ({}); find the cause, then imrig reset", trip_word(stands)),
          now);
    if (view.bridge->run_state != bridge_status_t::IDLE)
      return finish(RunnerEnd::kFailed, "the motor is being driven by somebody else", now);
    bridge_lease.acquire();
    if (view.needs_dyno) dyno_lease.acquire();
    enter(Phase::kLease, now);
  }

  void lease(Moment now) {
    if (bridge_lease.held() && (!view.needs_dyno || dyno_lease.held())) {
      connected = true;
      send(dataset_message(c.plan.name, c.rig));
      travel = travel_of(c.plan, c.rig, view.sample_time_s());
      zeros_since = view.watch.next_index();
      return enter(Phase::kZeros, now);
    }
    if (waited_us(now) < c.patience_us) return;
    const bool taken = bridge_lease.other_holder() != 0 || dyno_lease.other_holder() != 0;
    abandon(RunnerEnd::kFailed, taken ? "somebody else commands the rig" : "no command lease was granted",
            now);
  }

  void zeros(Moment now) {
    if (view.watch.next_index() - zeros_since < view.in_samples(kZeros_s)) {
      if (waited_us(now) > c.patience_us) abandon(RunnerEnd::kFailed, "the samples stopped", now);
      return;
    }
    begin_point(now);
  }

  // ---- points -------------------------------------------------------------------------------------------

  void begin_point(Moment now) {
    if (point < c.points.size()) {
      const CheckedPoint& p = c.points[point];
      actions.begin(actions_for(travel, p, actions.operating(), actions.excitation_A()), &p, now);
      return enter(Phase::kPoints, now);
    }
    actions.begin(actions_to_rest(travel, actions.operating(), actions.excitation_A()), nullptr, now);
    enter(Phase::kRest, now);
  }

  void points(Moment now) {
    if (const std::string problem = actions.step(now); !problem.empty()) return attempt_failed(problem, now);
    if (!actions.done()) return;
    next_point();
    tally.failed_in_row = 0;
    begin_point(now);
  }

  void attempt_failed(const std::string& why, Moment now) {
    const bool again = attempt <= c.retries && !actions.stalled_here();
    emit_failure(again ? RunnerEvent::kPointRetried : RunnerEvent::kPointFailed, why);
    if (again) {
      ++attempt;
    } else {
      tally.point_failed(actions.stalled_here(), false);
      if (tally.failed_in_row >= kFailedInRow)
        return abandon(RunnerEnd::kFailed,
                       fmt::format("{} points in a row failed; {}: {}", tally.failed_in_row,
                                   c.points[point].point.id, why),
                       now);
      next_point();
    }
    actions.recover();
    begin_point(now);
  }

  void emit_failure(RunnerEvent::Kind kind, const std::string& why) {
    RunnerEvent event;
    event.kind = kind;
    event.id = c.points[point].point.id;
    event.attempt = attempt;
    event.text = why;
    out.emit(event);
  }

  void next_point() {
    ++point;
    attempt = 1;
  }

  // ---- a trip that the plan allows ----------------------------------------------------------------------

  bool may_go_on() const {
    return phase == Phase::kPoints && trip == static_cast<std::int32_t>(Trip::kDeviceOverCurrent) &&
           tally.tripped < c.plan.limits.trips_allowed;
  }

  void point_tripped(Moment now) {
    actions.abort_record();
    actions.forget_commands();
    tally.point_failed(false, true);
    emit_failure(RunnerEvent::kPointFailed,
                 fmt::format("the rig tripped: {}, {} of {} allowed", trip_word(trip), tally.tripped,
                             c.plan.limits.trips_allowed));
    next_point();
    tripped_at = view.watch.next_index();
    reset_asked = false;
    enter(Phase::kTripped, now);
  }

  // Of what the bridge and the dyno say: the trip that is being reset, or one that followed it.
  static bool known(std::int32_t which) {
    return which == static_cast<std::int32_t>(Trip::kNone) ||
           which == static_cast<std::int32_t>(Trip::kDeviceOverCurrent) ||
           which == static_cast<std::int32_t>(Trip::kPeerTripped);
  }

  void tripped(Moment now) {
    if (!known(view.bridge->trip) || (view.dyno && !known(view.dyno->trip)))
      return abandon(RunnerEnd::kTripped, "the rig tripped: " + trip_word(trip), now);
    if (waited_us(now) > 2 * c.patience_us) return abandon_tripped("it cannot be reset", now);
    if (view.watch.next_index() - tripped_at < view.in_samples(kCoast_s)) return;
    if (!reset_asked) {
      actions.ask_reset();
      reset_asked = true;
      return;
    }
    if (actions.commands_pending()) return;
    if (!actions.refusal().empty()) return abandon_tripped(actions.refusal(), now);
    if (trip == 0) begin_point(now);
  }

  void abandon_tripped(const std::string& why, Moment now) {
    abandon(RunnerEnd::kTripped, fmt::format("the rig tripped: {}; reset: {}", trip_word(trip), why), now);
  }

  void rest(Moment now) {
    if (const std::string problem = actions.step(now); !problem.empty()) {
      if (!actions.stalled()) return abandon(RunnerEnd::kFailed, problem, now);
      actions.recover();
      return begin_point(now);  // none is left: to rest, this time without ramps
    }
    if (!actions.done()) return;
    actions.ask_load_off();
    enter(Phase::kConfirm, now);
  }

  // A point is done once the recorder says that its record's end is on disk.
  void confirm(Moment now) {
    auto& finished = actions.finished();
    while (!finished.empty()) {
      const FinishedRecord& f = finished.front();
      const bool on_disk = !c.needs_recorder || (view.recorder && view.recorder->flushed_record >= f.number);
      if (!on_disk) {
        if (now.steady_us - f.since_us > kConfirm_us)
          abandon(RunnerEnd::kFailed, fmt::format("imrig-recorder does not confirm record {}", f.id), now);
        return;
      }
      RunnerEvent event;
      event.kind = RunnerEvent::kPointDone;
      event.id = f.id;
      event.number = f.number;
      event.samples = f.samples;
      out.emit(event);
      ++tally.done;
      finished.pop_front();
    }
  }

  void all_confirmed(Moment now) {
    if (!actions.finished().empty() || actions.commands_pending()) return;
    finish(tally.failed == 0 ? RunnerEnd::kDone : RunnerEnd::kFailed, tally.sentence(), now);
  }

  // ---- stop and release ---------------------------------------------------------------------------------

  void stopping(Moment now) {
    const bool motor_off =
        view.bridge->run_state == bridge_status_t::IDLE || view.bridge->run_state == bridge_status_t::TRIPPED;
    const bool load_off = !view.dyno || view.dyno->run_state != dyno_status_t::ON;
    const bool off = motor_off && load_off && !actions.commands_pending() && actions.finished().empty();
    if (off || waited_us(now) > kStop_us) enter(Phase::kRelease, now);
  }

  void release(Moment now) {
    bridge_lease.release();
    dyno_lease.release();
    renew_leases(now);
    end = end_wanted;
    campaign_state = campaign_status_t::FAILED;
    if (end == RunnerEnd::kDone) campaign_state = campaign_status_t::DONE;
    if (end == RunnerEnd::kStopped) campaign_state = campaign_status_t::STOPPED;
    RunnerEvent event;
    event.kind = RunnerEvent::kEnded;
    event.text = reason;
    out.emit(event);
    publish_status();
    enter(Phase::kEnd, now);
  }

  // ---- every step ---------------------------------------------------------------------------------------

  void renew_leases(Moment now) {
    if (auto cmd = bridge_lease.step(now)) out.emit(*cmd);
    if (auto cmd = dyno_lease.step(now)) out.emit(*cmd);
  }

  void publish_status() {
    campaign_status_t s = {};
    s.campaign_status_v1 = 1;
    s.state = campaign_state;
    s.point = static_cast<std::int32_t>(point);
    s.points_done = tally.done;
    s.points_total = c.points_total;
    s.trip = trip;
    s.plan = c.plan.name;
    s.point_id = point < c.points.size() ? c.points[point].point.id : "";
    send(s);
  }

  void periodic(Moment now) {
    renew_leases(now);
    if (now.steady_us >= heartbeat_due_us) {
      heartbeat_due_us = now.steady_us + kHeartbeat_us;
      send(campaign_heartbeat(c.instance, c.pid, ending(), trip, now));
    }
    if (now.steady_us >= status_due_us) {
      status_due_us = now.steady_us + kStatus_us;
      publish_status();
    }
    if (const auto read = view.watch.acknowledge(now.steady_us)) send(campaign_ack(view.watch, *read, c.pid));
  }

  void advance(Moment now) {
    check_health(now);
    switch (phase) {
      case Phase::kConnect:
        return connect(now);
      case Phase::kLease:
        return lease(now);
      case Phase::kZeros:
        return zeros(now);
      case Phase::kPoints:
        return points(now);
      case Phase::kTripped:
        return tripped(now);
      case Phase::kRest:
        return rest(now);
      case Phase::kConfirm:
        return all_confirmed(now);
      case Phase::kStopping:
        return stopping(now);
      case Phase::kRelease:
        return release(now);
      case Phase::kEnd:
        return;
    }
  }

  std::vector<RunnerOutput> step(Moment now) {
    if (phase == Phase::kEnd) return {};
    if (phase_since_us < 0) phase_since_us = now.steady_us;
    confirm(now);
    advance(now);
    if (phase == Phase::kEnd) return out.take();
    actions.send(bridge_lease, dyno_lease, now);
    periodic(now);
    return out.take();
  }
};

const char* end_word(RunnerEnd end) {
  switch (end) {
    case RunnerEnd::kDone:
      return "done";
    case RunnerEnd::kStopped:
      return "stopped";
    case RunnerEnd::kTripped:
      return "tripped";
    case RunnerEnd::kFailed:
      return "failed";
    case RunnerEnd::kRunning:
      return "running";
  }
  return "";
}

Runner::Runner(RunnerConfig config) : s_(std::make_unique<State>(std::move(config))) {}
Runner::~Runner() = default;

void Runner::on(const bridge_status_t& message, Moment now) {
  s_->view.bridge = message;
  s_->view.bridge_us = now.steady_us;
  s_->actions.on(message, now);
}

void Runner::on(const dyno_status_t& message, Moment now) {
  s_->view.dyno = message;
  s_->view.dyno_us = now.steady_us;
  s_->actions.on(message, now);
}

void Runner::on(const samples_t& message, Moment now) { s_->view.watch.on(message, now.steady_us); }

void Runner::on(const estimate_t& message, Moment) {
  const bool of_now =
      message.boot_id == s_->view.watch.boot_id() && message.first_index >= s_->actions.since_index();
  if (of_now) s_->view.estimate = message;
}

void Runner::on(const lease_t& message, Moment now) {
  if (message.authority == heartbeat_t::BRIDGE) s_->bridge_lease.on_lease(message, now);
  if (message.authority == heartbeat_t::DYNO) s_->dyno_lease.on_lease(message, now);
}

void Runner::on(const ack_t& message, Moment now) {
  const std::int32_t ours = s_->c.recorder_pid;
  if (message.process != heartbeat_t::RECORDER || (ours != 0 && message.pid != ours)) return;
  s_->view.recorder = message;
  s_->view.recorder_us = now.steady_us;
}

void Runner::on(const estop_cmd_t&, Moment now) {
  s_->trip = static_cast<std::int32_t>(Trip::kOperatorStop);
  s_->abandon(RunnerEnd::kTripped, "the rig tripped: " + trip_word(s_->trip), now);
}

void Runner::request_stop(const std::string& why) { s_->stop_wanted = why; }
void Runner::fail(const std::string& why, Moment now) { s_->abandon(RunnerEnd::kFailed, why, now); }
std::vector<RunnerOutput> Runner::step(Moment now) { return s_->step(now); }
RunnerEnd Runner::end() const { return s_->end; }
bool Runner::connected() const { return s_->connected; }
std::string Runner::end_reason() const { return s_->reason; }
const Tally& Runner::tally() const { return s_->tally; }
std::int64_t Runner::lost_blocks() const { return s_->view.watch.lost_blocks(); }
std::string Runner::point_id() const {
  return s_->point < s_->c.points.size() ? s_->c.points[s_->point].point.id : "";
}

}  // namespace imrig
