// The ways out of a campaign: done, stopped, tripped, failed; records confirmed, motor and load off, leases
// given back.

#include <fmt/format.h>

#include "rig/campaign/runner_state.h"

namespace imrig {

using namespace imrig_msg;

namespace {

constexpr std::int64_t kConfirm_us =
    10'000'000;  // until the recorder must have said that a record is on disk
constexpr std::int64_t kStop_us =
    12'000'000;  // until a stop is given up and the leases are let go, which stops too
constexpr std::int64_t kUsualStatus_us = 500'000;  // a status comes ten times as often

}  // namespace

// The rig was not touched, or rests already.
void Runner::State::finish(RunnerEnd how, const std::string& why, Moment now) {
  end_wanted = how;
  reason = why;
  enter(Phase::kRelease, now);
}

// Whatever is going on.
void Runner::State::abandon(RunnerEnd how, const std::string& why, Moment now) {
  if (ending()) return;
  if (phase == Phase::kConnect) return finish(how, why, now);
  end_wanted = how;
  reason = why;
  actions.abort_record();
  actions.ask_stop();
  enter(Phase::kStopping, now);
}

void Runner::State::check_health(Moment now) {
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
void Runner::State::lease_lost(const char* who, std::int64_t heard_us, Moment now) {
  const bool dead = now.steady_us - heard_us > kUsualStatus_us;
  abandon(RunnerEnd::kFailed,
          dead ? fmt::format("{} is silent", who) : fmt::format("the command lease of {} was lost", who),
          now);
}

// A point is done once the recorder says that its record's end is on disk.
void Runner::State::confirm(Moment now) {
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

void Runner::State::all_confirmed(Moment now) {
  if (!actions.finished().empty() || actions.commands_pending()) return;
  finish(tally.failed == 0 ? RunnerEnd::kDone : RunnerEnd::kFailed, tally.sentence(), now);
}

void Runner::State::stopping(Moment now) {
  const bool motor_off =
      view.bridge->run_state == bridge_status_t::IDLE || view.bridge->run_state == bridge_status_t::TRIPPED;
  const bool load_off = !view.dyno || view.dyno->run_state != dyno_status_t::ON;
  const bool off = motor_off && load_off && !actions.commands_pending() && actions.finished().empty();
  if (off || waited_us(now) > kStop_us) enter(Phase::kRelease, now);
}

void Runner::State::release(Moment now) {
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

}  // namespace imrig
