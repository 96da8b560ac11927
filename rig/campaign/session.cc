#include "rig/campaign/session.h"

#include <exception>

#include "rig/base/clock.h"
#include "rig/bus/channels.h"

namespace imrig {

namespace {

using namespace imrig_msg;

constexpr int kWait_ms = 5;
constexpr std::int64_t kProgress_us = 200'000;

Moment now() { return {monotonic_us(), wall_us()}; }

template <class Message>
void feed(Bus& bus, const char* name, Runner& runner) {
  subscribe<Message>(bus, name, [&runner](const Message& message) { runner.on(message, now()); });
}

// Publishes messages, writes events; a journal that fails stops the campaign and is told once the rig rests.
class Outlet {
 public:
  Outlet(Bus& bus, Journal& journal, Runner& runner, const SessionHooks& hooks)
      : bus_(bus), journal_(journal), runner_(runner), hooks_(hooks) {}

  void operator()(const bridge_cmd_t& m) { publish(bus_, channel::kBridgeCmd, m); }
  void operator()(const dyno_cmd_t& m) { publish(bus_, channel::kDynoCmd, m); }
  void operator()(const lease_cmd_t& m) { publish(bus_, channel::kLeaseCmd, m); }
  void operator()(const record_t& m) { publish(bus_, channel::kRecord, m); }
  void operator()(const dataset_t& m) { publish(bus_, channel::kDataset, m); }
  void operator()(const campaign_status_t& m) { publish(bus_, channel::kCampaignStatus, m); }
  void operator()(const ack_t& m) { publish(bus_, channel::kAck, m); }
  void operator()(const heartbeat_t& m) { publish(bus_, channel::kHeartbeat, m); }
  void operator()(const RunnerEvent& event) {
    if (failure_) return;
    try {
      write(event);
    } catch (...) {
      failure_ = std::current_exception();
      runner_.request_stop("the journal cannot be written");
    }
    if (hooks_.event) hooks_.event(event);
  }

  void rethrow() const {
    if (failure_) std::rethrow_exception(failure_);
  }

 private:
  void write(const RunnerEvent& e) {
    switch (e.kind) {
      case RunnerEvent::kRecordBegun:
        return journal_.record_begun(e.id, e.number);
      case RunnerEvent::kPointDone:
        return journal_.point_done({e.id, e.number, journal_.part(), e.samples});
      case RunnerEvent::kPointRetried:
        return journal_.point_retried(e.id, e.attempt, e.text);
      case RunnerEvent::kPointFailed:
        return journal_.point_failed(e.id, e.text);
      case RunnerEvent::kEnded:
        return journal_.ended(end_word(runner_.end()), e.text);
    }
  }

  Bus& bus_;
  Journal& journal_;
  Runner& runner_;
  const SessionHooks& hooks_;
  std::exception_ptr failure_;
};

void subscribe_all(Bus& bus, Runner& runner) {
  feed<bridge_status_t>(bus, channel::kBridgeStatus, runner);
  feed<dyno_status_t>(bus, channel::kDynoStatus, runner);
  feed<samples_t>(bus, channel::kSamples, runner);
  feed<estimate_t>(bus, channel::kEstimate, runner);
  feed<lease_t>(bus, channel::kBridgeLease, runner);
  feed<lease_t>(bus, channel::kDynoLease, runner);
  feed<ack_t>(bus, channel::kAck, runner);
  feed<estop_cmd_t>(bus, channel::kEstopCmd, runner);
}

}  // namespace

RunnerEnd run_session(Runner& runner, Bus& bus, Journal& journal, const SessionHooks& hooks) {
  subscribe_all(bus, runner);
  Outlet outlet(bus, journal, runner, hooks);
  std::int64_t progress_us = 0;
  while (runner.end() == RunnerEnd::kRunning) {
    bus.wait(kWait_ms);
    const Moment moment = now();
    if (hooks.stop_asked && hooks.stop_asked()) runner.request_stop("stopped by the operator");
    if (hooks.broken)
      if (const std::string why = hooks.broken(); !why.empty()) runner.fail(why, moment);
    for (const RunnerOutput& output : runner.step(moment)) std::visit(outlet, output);
    if (hooks.progress && moment.steady_us - progress_us > kProgress_us) {
      progress_us = moment.steady_us;
      hooks.progress(runner);
    }
  }
  if (hooks.progress) hooks.progress(runner);
  outlet.rethrow();
  return runner.end();
}

}  // namespace imrig
