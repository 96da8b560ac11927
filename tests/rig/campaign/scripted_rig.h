#pragma once
// Bridge, dyno, recorder and estimator as a script on a memory bus, in simulated time: leases by the real
// authority, profiles that run sample by sample, and faults on request.

#include <functional>
#include <imrig_msg/bridge_cmd_t.hpp>
#include <imrig_msg/bridge_status_t.hpp>
#include <imrig_msg/dyno_cmd_t.hpp>
#include <imrig_msg/dyno_status_t.hpp>
#include <imrig_msg/record_t.hpp>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "rig/bus/bus.h"
#include "rig/campaign/runner.h"
#include "rig/safety/lease_authority.h"

namespace imrig::test {

// What goes wrong.
struct Faults {
  std::map<int, int> lose_blocks_of_record;  // record number -> blocks to lose
  std::map<int, int> refuse_uploads;         // result -> how often
  std::map<int, int> refuse_starts;
  int trip_in_record = 0;             // record number in which the device trips
  int trip_in_every_record_from = 0;  // or in every one from this on; 0: in none
  bool refuses_resets = false;
  double field_lag_s = 0.0;  // rig time for which the supply still reads its old current after a lesser one
  std::int32_t trip = 0;
  int ignore_dyno_commands = 0;
  bool dyno_silent_after_set = false;
  bool bridge_silent_in_record = false;  // ... 2
  bool recorder_confirms = true;
  bool recorder_speaks = true;
  bool estimator_runs = true;
  bool stalls = false;
  bool stalls_when_unloaded = false;  // once
  bool dsp_absent = false;
  bool lease_taken = false;
  bool reboots_in_record = false;  // ... 2
  std::int32_t standing_trip = 0;
};

class ScriptedRig {
 public:
  explicit ScriptedRig(std::shared_ptr<MemoryHub> hub);
  Faults faults;

  // One tick of 5 ms: takes commands, lets rig time pass, publishes.
  void tick(Moment now);

  // What was seen.
  std::vector<imrig_msg::record_t> records;    // BEGIN and END in order
  std::map<int, std::int64_t> record_samples;  // by number, as published
  int datasets = 0;
  int resets = 0;  // carried out
  int starts_while_stalled = 0;
  double most_readback_when_moved_A = 0.0;  // while the inverter's frequency changes
  int acks = 0;
  std::int32_t last_campaign_state = 0;
  bool driven() const {
    return state_ == imrig_msg::bridge_status_t::RUNNING || state_ == imrig_msg::bridge_status_t::HOLDING;
  }
  bool load_on() const { return output_on_; }
  double most_frequency_step_Hz = 0.0;  // between samples while driven
  double most_voltage_ratio = 1.0;      // between two segments, loaded or not

 private:
  void on_bridge_cmd(const imrig_msg::bridge_cmd_t& cmd);
  void on_dyno_cmd(const imrig_msg::dyno_cmd_t& cmd);
  std::int32_t carry_out(const imrig_msg::bridge_cmd_t& cmd);
  void run_samples(int n, Moment now);
  void publish_block(int n, std::int32_t segment, std::int32_t record, bool gates);
  void publish_states(Moment now);
  double field() const;
  imrig_msg::bridge_status_t bridge_status() const;

  std::unique_ptr<Bus> bus_;
  LeaseAuthority bridge_lease_;
  LeaseAuthority dyno_lease_;
  Moment now_;
  std::int64_t index_ = 0;
  std::int64_t block_seq_ = 0;
  std::int64_t boot_id_ = 11;
  std::int32_t encoder_ = 0;
  double frequency_Hz_ = 0.0;
  double voltage_V_ = 0.0;

  std::int32_t state_ = imrig_msg::bridge_status_t::IDLE;
  std::int32_t trip_ = 0;
  std::optional<imrig_msg::bridge_cmd_t> loaded_;
  std::optional<imrig_msg::bridge_cmd_t> running_;
  int segment_ = -1;
  std::int64_t left_in_segment_ = 0;
  std::int64_t last_epoch_ = 0, last_seq_ = 0;
  std::int32_t last_result_ = 0;

  bool output_on_ = false;
  double target_ = 0.0;
  double field_A_ = 0.0;
  std::int64_t field_since_ = 0;  // sample index of the last order
  std::int64_t dyno_epoch_ = 0, dyno_seq_ = 0;
  std::int32_t flushed_record_ = 0;
  std::int64_t seq_ = 0;
  bool bridge_silent_ = false;
  bool dyno_silent_ = false;
  bool stalled_ = false;
};

}  // namespace imrig::test
