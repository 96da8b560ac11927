// Point after point, what becomes of one that fails, and the trips that a plan allows.

#include <fmt/format.h>

#include "rig/campaign/runner_state.h"

namespace imrig {

using namespace imrig_msg;

namespace {

constexpr int kFailedInRow = 3;
constexpr double kCoast_s = 2.0;  // rig time from a trip to its reset: currents and excitation die out

// Of what the bridge and the dyno say: the trip that is being reset, or one that followed it.
bool known(std::int32_t which) {
  return which == static_cast<std::int32_t>(Trip::kNone) ||
         which == static_cast<std::int32_t>(Trip::kDeviceOverCurrent) ||
         which == static_cast<std::int32_t>(Trip::kPeerTripped);
}

}  // namespace

void Runner::State::begin_point(Moment now) {
  if (point < c.points.size()) {
    const CheckedPoint& p = c.points[point];
    actions.begin(actions_for(travel, p, actions.operating(), actions.excitation_A()), &p, now);
    return enter(Phase::kPoints, now);
  }
  actions.begin(actions_to_rest(travel, actions.operating(), actions.excitation_A()), nullptr, now);
  enter(Phase::kRest, now);
}

void Runner::State::points(Moment now) {
  if (const std::string problem = actions.step(now); !problem.empty()) return attempt_failed(problem, now);
  if (!actions.done()) return;
  next_point();
  tally.failed_in_row = 0;
  begin_point(now);
}

void Runner::State::attempt_failed(const std::string& why, Moment now) {
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

void Runner::State::emit_failure(RunnerEvent::Kind kind, const std::string& why) {
  RunnerEvent event;
  event.kind = kind;
  event.id = c.points[point].point.id;
  event.attempt = attempt;
  event.text = why;
  out.emit(event);
}

void Runner::State::next_point() {
  ++point;
  attempt = 1;
}

bool Runner::State::may_go_on() const {
  return phase == Phase::kPoints && trip == static_cast<std::int32_t>(Trip::kDeviceOverCurrent) &&
         tally.tripped < c.plan.limits.trips_allowed;
}

void Runner::State::point_tripped(Moment now) {
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

void Runner::State::tripped(Moment now) {
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

void Runner::State::abandon_tripped(const std::string& why, Moment now) {
  abandon(RunnerEnd::kTripped, fmt::format("the rig tripped: {}; reset: {}", trip_word(trip), why), now);
}

void Runner::State::rest(Moment now) {
  if (const std::string problem = actions.step(now); !problem.empty()) {
    if (!actions.stalled()) return abandon(RunnerEnd::kFailed, problem, now);
    actions.recover();
    return begin_point(now);  // none is left: to rest, this time without ramps
  }
  if (!actions.done()) return;
  actions.ask_load_off();
  enter(Phase::kConfirm, now);
}

}  // namespace imrig
