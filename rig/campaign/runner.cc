#include "rig/campaign/runner.h"

#include "rig/campaign/runner_messages.h"
#include "rig/campaign/runner_state.h"

namespace imrig {

using namespace imrig_msg;

namespace {

constexpr std::int64_t kHeartbeat_us = 200'000;
constexpr std::int64_t kStatus_us = 500'000;

}  // namespace

void Runner::State::renew_leases(Moment now) {
  if (auto cmd = bridge_lease.step(now)) out.emit(*cmd);
  if (auto cmd = dyno_lease.step(now)) out.emit(*cmd);
}

void Runner::State::publish_status() {
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

void Runner::State::periodic(Moment now) {
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

void Runner::State::advance(Moment now) {
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

std::vector<RunnerOutput> Runner::State::step(Moment now) {
  if (phase == Phase::kEnd) return {};
  if (phase_since_us < 0) phase_since_us = now.steady_us;
  confirm(now);
  advance(now);
  if (phase == Phase::kEnd) return out.take();
  actions.send(bridge_lease, dyno_lease, now);
  periodic(now);
  return out.take();
}

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
