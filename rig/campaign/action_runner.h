#pragma once
// Carries out the actions of one point, one after the other: commands to bridge and dyno with their answers,
// waits in rig time, the record with its BEGIN and END. BEGIN is published before the START that makes its
// first sample and END after its last one came, so in every receiver's order the record's samples lie between
// the two.

#include <deque>
#include <imrig_msg/bridge_cmd_t.hpp>
#include <imrig_msg/dyno_cmd_t.hpp>
#include <string>
#include <vector>

#include "rig/campaign/command_exchange.h"
#include "rig/campaign/rig_view.h"
#include "rig/campaign/runner_output.h"
#include "rig/campaign/sequence.h"

namespace imrig {

// What every record of a campaign says of itself.
struct RecordFacts {
  std::string campaign;
  std::int64_t config_hash = 0;
  int pole_pairs = 0;
};

struct FinishedRecord {
  std::string id;
  int number = 0;
  std::int64_t samples = 0;
  std::int64_t since_us = 0;  // steady time of its END
};

class ActionRunner {
 public:
  // view and out must outlive it. patience_us: steady time without progress after which an action fails.
  ActionRunner(RigView& view, Outbox& out, RecordFacts facts, int first_record_number, int first_profile_id,
               std::int64_t patience_us);

  // point may be null when no action records.
  void begin(std::vector<Action> actions, const CheckedPoint* point, Moment now);
  // Goes on; returns what failed, empty while all is well. The actions then end.
  std::string step(Moment now);
  bool done() const { return action_ >= actions_.size(); }

  bool stalled() const { return stalled_; }            // the last failure was the motor's ...
  bool stalled_here() const { return stalled_here_; }  // ... at this point: another try ends the same

  void abort_record();  // publishes the END of a record that runs, as aborted
  void ask_stop();      // motor and load, whatever is going on
  void ask_load_off();
  void ask_reset();  // of bridge and dyno, after a trip; from then on the rig is taken to coast without load
  const std::string& refusal()
      const;  // why the last command was not carried out; empty: it was, or is on its way
  void forget_commands();

  // Publishes what has to go out, with the leases' signatures.
  void send(LeaseClient& bridge, LeaseClient& dyno, Moment now);
  void on(const imrig_msg::bridge_status_t& status, Moment now) { to_bridge_.answer(status, now); }
  void on(const imrig_msg::dyno_status_t& status, Moment now) { to_dyno_.answer(status, now); }
  bool commands_pending() const { return to_bridge_.busy() || to_dyno_.busy(); }

  // Estimates of windows that begin before this index say nothing about the running action.
  std::int64_t since_index() const { return judged_from_; }
  const Operating& operating() const { return operating_; }
  double excitation_A() const { return excitation_A_; }
  // After a failure: goes on from the held operating point if the device still holds it and the motor turns,
  // else from rest.
  void recover();

  std::deque<FinishedRecord>& finished() { return finished_; }

 private:
  enum class Step { kUpload, kStart, kRun };

  std::string run(const Action& action, Moment now);
  std::string load(const Action& action, Moment now);
  std::string profile(const Action& action, Moment now);
  std::string rest(const Action& action, Moment now);
  std::string settle(const Action& action, Moment now);
  std::string record(const Action& action, Moment now);

  std::string stall(const Action& action);
  bool field_followed(const Action& action) const;
  void upload(const Profile& profile);
  bool get_going(std::string& problem, Moment now);
  bool ran_through(const Profile& profile) const;
  void begin_record(const Action& action);
  std::string end_record(Moment now);
  void publish_end(std::int32_t status);
  imrig_msg::record_t record_message(std::int32_t phase);
  void next(Moment now);
  std::string late(Moment now, const char* what) const;
  std::string stuck(Moment now) const;

  RigView& view_;
  Outbox& out_;
  RecordFacts facts_;
  std::int64_t patience_us_;
  CommandExchange<imrig_msg::bridge_cmd_t, imrig_msg::bridge_status_t> to_bridge_;
  CommandExchange<imrig_msg::dyno_cmd_t, imrig_msg::dyno_status_t> to_dyno_;

  std::vector<Action> actions_;
  const CheckedPoint* point_ = nullptr;
  std::size_t action_ = 0;
  bool entered_ = false;  // the running action has been begun
  Step step_ = Step::kUpload;
  std::int64_t since_us_ = 0;     // steady time the running action began
  std::int64_t since_index_ = 0;  // sample index at which its waiting part began; -1: not yet
  std::int64_t judged_from_ = 0;  // sample index from which on the motor's slip counts
  int loaded_profile_ = 0;        // uploaded, not yet started
  Operating operating_;
  double excitation_A_ = 0.0;
  double load_from_A_ = 0.0;  // excitation before the running kLoad
  bool recording_ = false;
  bool stalled_ = false;
  bool stalled_here_ = false;
  std::int64_t expected_ = 0;
  std::int64_t lost_before_ = 0;  // at the recorder, before the record
  int record_number_;
  int profile_id_;
  std::deque<FinishedRecord> finished_;
};

}  // namespace imrig
