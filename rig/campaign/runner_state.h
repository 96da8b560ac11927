#pragma once
// The state of a running campaign; runner.h tells its phases. What happens in them stands by idea:
// runner_begin.cc (who answers, leases, zeros), runner_points.cc (point after point, trips that the plan
// allows), runner_end.cc (the ways out), runner.cc (every step).

#include <algorithm>
#include <string>

#include "rig/campaign/action_runner.h"
#include "rig/campaign/runner.h"
#include "rig/safety/trip.h"

namespace imrig {

inline std::string trip_word(std::int32_t trip) { return std::string(trip_name(static_cast<Trip>(trip))); }

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
        bridge_lease(imrig_msg::heartbeat_t::BRIDGE, c.holder, std::int64_t{1000} * c.rig.limits.lease_ms),
        dyno_lease(imrig_msg::heartbeat_t::DYNO, c.holder, std::int64_t{1000} * c.rig.limits.lease_ms),
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
  std::int32_t campaign_state = imrig_msg::campaign_status_t::RUNNING;
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

  // runner_begin.cc
  void connect(Moment now);
  void lease(Moment now);
  void zeros(Moment now);

  // runner_points.cc
  void begin_point(Moment now);
  void points(Moment now);
  void attempt_failed(const std::string& why, Moment now);
  void emit_failure(RunnerEvent::Kind kind, const std::string& why);
  void next_point();
  bool may_go_on() const;
  void point_tripped(Moment now);
  void tripped(Moment now);
  void abandon_tripped(const std::string& why, Moment now);
  void rest(Moment now);

  // runner_end.cc
  void finish(RunnerEnd how, const std::string& why, Moment now);
  void abandon(RunnerEnd how, const std::string& why, Moment now);
  void check_health(Moment now);
  void lease_lost(const char* who, std::int64_t heard_us, Moment now);
  void confirm(Moment now);
  void all_confirmed(Moment now);
  void stopping(Moment now);
  void release(Moment now);

  // runner.cc
  void renew_leases(Moment now);
  void publish_status();
  void periodic(Moment now);
  void advance(Moment now);
  std::vector<RunnerOutput> step(Moment now);
};

}  // namespace imrig
