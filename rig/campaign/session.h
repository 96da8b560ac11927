#pragma once
// Gives a Runner its bus and its journal: subscribes, hands over messages and time, publishes what comes out.
// The only place of the campaign that reads a clock.

#include <functional>

#include "rig/bus/bus.h"
#include "rig/campaign/journal.h"
#include "rig/campaign/runner.h"

namespace imrig {

struct SessionHooks {
  std::function<bool()> stop_asked;             // true: stop safely
  std::function<std::string()> broken;          // a sentence when the rig's processes have failed, else empty
  std::function<void(const Runner&)> progress;  // a few times a second, and at each event
  std::function<void(const RunnerEvent&)> event;  // after it was journalled
};

// Runs to the end. Throws Error when the journal cannot be written; the rig is stopped before.
RunnerEnd run_session(Runner& runner, Bus& bus, Journal& journal, const SessionHooks& hooks);

}  // namespace imrig
