#pragma once
// Runs a campaign: a state machine that is fed with messages and time and answers with messages to publish
// and events for the journal. No LCM, clock, thread or file in here; session.h gives it a bus and a journal.
//
//   connect -> lease -> zeros -> points -> rest -> confirm -> release -> end
//   any of these --stop, trip, failure--> stopping -> release -> end
//   points --over-current trip of the device, as often as the plan allows--> tripped -> points
//
// zeros: gates off at rest, for the sensors' zeros. A record is complete when every sample of it came, here
// and at the recorder, in one piece; else it ends as aborted and the point is run again, at most `retries`
// times. A point is done once the recorder says that its record's end is on disk. A trip, a lost lease or a
// silent process ends the campaign: the rig is stopped, never left holding. tripped: the plan allows trips;
// the point is given up, the rig coasts for kCoast_s, bridge and dyno are reset, the next point starts from
// rest. An emergency stop meanwhile ends the campaign, though the trip that stands hides it in the status.

#include <cstdint>
#include <imrig_msg/estop_cmd_t.hpp>
#include <imrig_msg/lease_t.hpp>
#include <memory>
#include <string>
#include <vector>

#include "rig/base/rig_config.h"
#include "rig/campaign/rig_view.h"
#include "rig/campaign/runner_output.h"
#include "rig/campaign/sequence.h"
#include "rig/campaign/tally.h"
#include "rig/safety/moment.h"

namespace imrig {

struct RunnerConfig {
  RigConfig rig;
  Plan plan;  // name and rates
  std::int64_t config_hash = 0;
  std::vector<CheckedPoint> points;  // in the order to run, finished ones left out
  int points_total = 0;              // with those finished in earlier runs
  int first_record_number = 1;
  int first_profile_id = 1;
  int retries = 2;                        // of a point, after its first attempt
  std::int64_t patience_us = 10'000'000;  // steady time without progress after which the campaign gives up
  std::int64_t holder = 1;                // this client's id at the leases
  std::int64_t instance = 1;              // of the heartbeat
  std::int32_t pid = 0;
  bool needs_recorder = true;     // wait for a recorder's acknowledgements
  std::int32_t recorder_pid = 0;  // of the campaign's own recorder; 0: any
};

enum class RunnerEnd { kRunning, kDone, kStopped, kTripped, kFailed };
const char* end_word(RunnerEnd end);  // "done", "stopped", "tripped", "failed"

class Runner {
 public:
  explicit Runner(RunnerConfig config);
  ~Runner();

  void on(const imrig_msg::bridge_status_t& message, Moment now);
  void on(const imrig_msg::dyno_status_t& message, Moment now);
  void on(const imrig_msg::samples_t& message, Moment now);
  void on(const imrig_msg::estimate_t& message, Moment now);
  void on(const imrig_msg::lease_t& message, Moment now);
  void on(const imrig_msg::ack_t& message, Moment now);
  void on(const imrig_msg::estop_cmd_t& message, Moment now);
  void request_stop(const std::string& why);      // stop safely
  void fail(const std::string& why, Moment now);  // likewise, because something broke

  // Call after every batch of messages and at least every 20 ms. What it returns is to be published, or
  // written, in this order.
  std::vector<RunnerOutput> step(Moment now);

  bool connected() const;          // the whole rig answered, stood ready and granted its leases
  RunnerEnd end() const;           // kRunning until the rig rests and the leases are given back
  std::string end_reason() const;  // one sentence, empty when done
  const Tally& tally() const;
  std::int64_t lost_blocks() const;  // of samples, as seen by the campaign
  std::string point_id() const;      // running now

 private:
  struct State;
  std::unique_ptr<State> s_;
};

}  // namespace imrig
