// How a campaign begins: is the rig there and free, leases, zeros of the sensors.

#include <fmt/format.h>

#include "rig/campaign/runner_messages.h"
#include "rig/campaign/runner_state.h"

namespace imrig {

using namespace imrig_msg;

namespace {

// A zero of the voltage that is off by 4 mV is 10 mA of direct current in a motor of 0.39 ohm, a quarter of
// the error that noise makes: 25,000 samples bring it to 2 mV.
constexpr double kZeros_s = 1.5;

}  // namespace

void Runner::State::connect(Moment now) {
  if (const std::string missing = view.missing(); !missing.empty()) {
    if (waited_us(now) > c.patience_us) finish(RunnerEnd::kFailed, missing, now);
    return;
  }
  if (const std::int32_t stands = view.trip(); stands != 0)
    return finish(
        RunnerEnd::kFailed,
        fmt::format("the rig stands tripped ({}); find the cause, then imrig reset", trip_word(stands)), now);
  if (view.bridge->run_state != bridge_status_t::IDLE)
    return finish(RunnerEnd::kFailed, "the motor is being driven by somebody else", now);
  bridge_lease.acquire();
  if (view.needs_dyno) dyno_lease.acquire();
  enter(Phase::kLease, now);
}

void Runner::State::lease(Moment now) {
  if (bridge_lease.held() && (!view.needs_dyno || dyno_lease.held())) {
    connected = true;
    send(dataset_message(c.plan.name, c.rig));
    travel = travel_of(c.plan, c.rig, view.sample_time_s());
    zeros_since = view.watch.next_index();
    return enter(Phase::kZeros, now);
  }
  if (waited_us(now) < c.patience_us) return;
  const bool taken = bridge_lease.other_holder() != 0 || dyno_lease.other_holder() != 0;
  abandon(RunnerEnd::kFailed, taken ? "somebody else commands the rig" : "no command lease was granted", now);
}

void Runner::State::zeros(Moment now) {
  if (view.watch.next_index() - zeros_since < view.in_samples(kZeros_s)) {
    if (waited_us(now) > c.patience_us) abandon(RunnerEnd::kFailed, "the samples stopped", now);
    return;
  }
  begin_point(now);
}

}  // namespace imrig
