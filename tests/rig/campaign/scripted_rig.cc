#include "tests/rig/campaign/scripted_rig.h"

#include <algorithm>
#include <cmath>
#include <imrig_msg/ack_t.hpp>
#include <imrig_msg/campaign_status_t.hpp>
#include <imrig_msg/dataset_t.hpp>
#include <imrig_msg/estimate_t.hpp>
#include <imrig_msg/heartbeat_t.hpp>
#include <imrig_msg/lease_t.hpp>
#include <imrig_msg/samples_t.hpp>

#include "rig/bus/channels.h"
#include "rig/safety/command_result.h"

namespace imrig::test {

using namespace imrig_msg;

namespace {

constexpr int kSamplesPerTick = 400;  // 24 ms of rig time in 5 ms: about five times real time
constexpr int kBlock = 100;
constexpr int kEncoderCounts = 4096;

LeaseAuthority::RandomId counting(std::int64_t from) {
  return [next = from]() mutable { return ++next; };
}

// True when one was left to take.
bool take_one(std::map<int, int>& counts, int& key) {
  for (auto& [k, left] : counts)
    if (left > 0) {
      --left;
      key = k;
      return true;
    }
  return false;
}

}  // namespace

ScriptedRig::ScriptedRig(std::shared_ptr<MemoryHub> hub)
    : bus_(open_memory_bus(std::move(hub))),
      bridge_lease_(heartbeat_t::BRIDGE, 2'000'000, counting(100)),
      dyno_lease_(heartbeat_t::DYNO, 2'000'000, counting(900)) {
  subscribe<bridge_cmd_t>(*bus_, channel::kBridgeCmd, [this](const bridge_cmd_t& m) { on_bridge_cmd(m); });
  subscribe<dyno_cmd_t>(*bus_, channel::kDynoCmd, [this](const dyno_cmd_t& m) { on_dyno_cmd(m); });
  subscribe<lease_cmd_t>(*bus_, channel::kLeaseCmd, [this](const lease_cmd_t& m) {
    if (faults.lease_taken && m.holder != 4711) return;
    bridge_lease_.request(m, now_);
    dyno_lease_.request(m, now_);
  });
  subscribe<record_t>(*bus_, channel::kRecord, [this](const record_t& m) {
    records.push_back(m);
    if (m.phase == record_t::END && faults.recorder_confirms) flushed_record_ = m.number;
  });
  subscribe<dataset_t>(*bus_, channel::kDataset, [this](const dataset_t&) { ++datasets; });
  subscribe<ack_t>(*bus_, channel::kAck,
                   [this](const ack_t& m) { acks += m.process == heartbeat_t::CAMPAIGN ? 1 : 0; });
  subscribe<campaign_status_t>(*bus_, channel::kCampaignStatus,
                               [this](const campaign_status_t& m) { last_campaign_state = m.state; });
}

void ScriptedRig::on_bridge_cmd(const bridge_cmd_t& cmd) {
  if (bridge_silent_) return;
  last_epoch_ = cmd.lease_epoch;
  last_seq_ = cmd.seq;
  last_result_ = carry_out(cmd);
}

// A field current falls late.
double ScriptedRig::field() const {
  const bool late = static_cast<double>(index_ - field_since_) * 60e-6 < faults.field_lag_s;
  return late ? std::max(field_A_, target_) : target_;
}

std::int32_t ScriptedRig::carry_out(const bridge_cmd_t& cmd) {
  if (cmd.lease_epoch != bridge_lease_.epoch() || cmd.lease_epoch == 0)
    return static_cast<std::int32_t>(CommandResult::kNoLease);
  if (cmd.action == bridge_cmd_t::RESET && faults.refuses_resets)
    return static_cast<std::int32_t>(CommandResult::kCauseRemains);
  if (cmd.action == bridge_cmd_t::RESET && trip_ != 0) {
    ++resets;
    trip_ = 0;
    state_ = bridge_status_t::IDLE;
    running_.reset();
  }
  if (trip_ != 0) return static_cast<std::int32_t>(CommandResult::kTripped);
  int refusal = 0;
  switch (cmd.action) {
    case bridge_cmd_t::UPLOAD:
      if (take_one(faults.refuse_uploads, refusal)) return refusal;
      loaded_ = cmd;
      return 0;
    case bridge_cmd_t::START:
      if (take_one(faults.refuse_starts, refusal)) return refusal;
      if (!loaded_ || loaded_->profile_id != cmd.profile_id) return 102;
      if (state_ == bridge_status_t::RUNNING) return 104;
      running_ = std::exchange(loaded_, std::nullopt);
      if (stalled_) ++starts_while_stalled;
      segment_ = 0;
      left_in_segment_ = running_->segments[0].duration_samples;
      state_ = bridge_status_t::RUNNING;
      return 0;
    case bridge_cmd_t::STOP:
      running_.reset();
      stalled_ = false;
      state_ = bridge_status_t::IDLE;
      frequency_Hz_ = voltage_V_ = 0.0;
      return 0;
    default:
      return 0;
  }
}

void ScriptedRig::on_dyno_cmd(const dyno_cmd_t& cmd) {
  if (dyno_silent_ || faults.ignore_dyno_commands-- > 0) return;
  field_A_ = field();
  field_since_ = index_;
  dyno_epoch_ = cmd.lease_epoch;
  dyno_seq_ = cmd.seq;
  if (driven() && cmd.value < target_)
    stalled_ = std::exchange(faults.stalls_when_unloaded, false) || stalled_;
  output_on_ = cmd.action == dyno_cmd_t::SET;
  target_ = cmd.action == dyno_cmd_t::SET ? cmd.value : 0.0;
  if (faults.dyno_silent_after_set && target_ > 0) dyno_silent_ = true;
}

void ScriptedRig::publish_block(int n, std::int32_t segment, std::int32_t record, bool gates) {
  samples_t s = {};
  s.utime = index_ * 60;
  s.seq = block_seq_++;
  s.samples_v1 = 1;
  s.boot_id = boot_id_;
  s.first_index = index_;
  s.sample_time_ns = 60000;
  s.segment = segment;
  s.profile_id = running_ && segment >= 0 ? running_->profile_id : 0;
  s.record = record;
  s.gates_on = gates ? 1 : 0;
  s.current_A_per_count = 0.02F;
  s.voltage_V_per_count = 0.2F;
  s.full_scale_counts = 2047;
  s.encoder_counts_per_rev = kEncoderCounts;
  s.n = n;
  for (auto* channel : {&s.i_a, &s.i_b, &s.i_c, &s.v_a, &s.v_b, &s.v_c})
    channel->assign(static_cast<std::size_t>(n), 0);
  s.encoder.assign(static_cast<std::size_t>(n), 0);
  for (int k = 0; k < n; ++k) {
    encoder_ += static_cast<std::int32_t>(std::lround(frequency_Hz_ / 2 * kEncoderCounts * 60e-6));
    s.encoder[static_cast<std::size_t>(k)] = encoder_;
  }
  index_ += n;
  if (auto lose = faults.lose_blocks_of_record.find(record);
      lose != faults.lose_blocks_of_record.end() && lose->second > 0) {
    --lose->second;
    return;
  }
  if (record != 0) record_samples[record] += n;
  publish(*bus_, channel::kSamples, s);
}

void ScriptedRig::run_samples(int n, Moment) {
  while (n > 0) {
    if (state_ != bridge_status_t::RUNNING) {
      const int part = std::min(n, kBlock);
      publish_block(part, -1, 0, state_ == bridge_status_t::HOLDING);
      n -= part;
      continue;
    }
    const segment_t& s = running_->segments[segment_];
    const int part = static_cast<int>(std::min<std::int64_t>({n, kBlock, left_in_segment_}));
    const bool voltage = s.kind == segment_t::VOLTAGE;
    if (voltage && left_in_segment_ == s.duration_samples) {
      most_frequency_step_Hz =
          std::max(most_frequency_step_Hz, std::abs(s.frequency_start_Hz - frequency_Hz_));
      if (voltage_V_ > 0) most_voltage_ratio = std::max(most_voltage_ratio, s.amplitude_start_V / voltage_V_);
    }
    publish_block(part, segment_, s.record, s.kind != segment_t::GATES_OFF);
    n -= part;
    left_in_segment_ -= part;
    frequency_Hz_ = voltage ? s.frequency_end_Hz : 0.0;
    voltage_V_ = voltage ? s.amplitude_end_V : 0.0;
    if (field() > 0 && voltage && s.frequency_start_Hz != s.frequency_end_Hz)
      most_readback_when_moved_A = std::max(most_readback_when_moved_A, field());
    const bool trips = faults.trip_in_every_record_from != 0 && s.record >= faults.trip_in_every_record_from;
    if (s.record != 0 && (trips || s.record == faults.trip_in_record)) {
      trip_ = faults.trip;
      state_ = bridge_status_t::TRIPPED;
      frequency_Hz_ = voltage_V_ = target_ = 0.0;
      output_on_ = false;
      continue;
    }
    if (s.record == 2 && faults.bridge_silent_in_record) bridge_silent_ = true;
    if (s.record == 2 && faults.reboots_in_record) boot_id_ = 12;
    if (left_in_segment_ > 0) continue;
    if (++segment_ < running_->n_segments) {
      left_in_segment_ = running_->segments[segment_].duration_samples;
      continue;
    }
    const bool hold = running_->at_end == bridge_cmd_t::AT_END_HOLD;
    state_ = bridge_status_t::IDLE;
    if (hold) state_ = bridge_status_t::HOLDING;
    if (!hold) frequency_Hz_ = voltage_V_ = 0.0;
  }
}

bridge_status_t ScriptedRig::bridge_status() const {
  bridge_status_t b = {};
  b.bridge_status_v1 = 1;
  b.link_state = bridge_status_t::LINK_UP;
  if (faults.dsp_absent) b.link_state = bridge_status_t::LINK_ABSENT;
  b.run_state = state_;
  b.trip = trip_ != 0 ? trip_ : faults.standing_trip;
  b.boot_id = boot_id_;
  b.profile_id = running_ && driven() ? running_->profile_id : 0;
  b.profile_loaded = loaded_ ? loaded_->profile_id : 0;
  b.last_cmd_epoch = last_epoch_;
  b.last_cmd_seq = last_seq_;
  b.last_cmd_result = last_result_;
  return b;
}

void ScriptedRig::publish_states(Moment now) {
  if (!bridge_silent_) {
    publish(*bus_, channel::kBridgeStatus, bridge_status());
    lease_t lease = bridge_lease_.status(now);
    lease.seq = ++seq_;
    if (faults.lease_taken) lease.holder = lease.epoch = 4711;
    publish(*bus_, channel::kBridgeLease, lease);
  }
  if (!dyno_silent_) {
    dyno_status_t d = {};
    d.dyno_status_v1 = 1;
    d.link_state = dyno_status_t::LINK_UP;
    d.run_state = dyno_status_t::OFF;
    if (output_on_) d.run_state = dyno_status_t::ON;
    d.target = target_;
    d.at_target = 1;
    d.readback_A = field();
    d.last_cmd_epoch = dyno_epoch_;
    d.last_cmd_seq = dyno_seq_;
    publish(*bus_, channel::kDynoStatus, d);
    lease_t lease = dyno_lease_.status(now);
    lease.seq = ++seq_;
    publish(*bus_, channel::kDynoLease, lease);
  }
  if (faults.recorder_speaks) {
    ack_t ack = {};
    ack.ack_v1 = 1;
    ack.boot_id = boot_id_;
    ack.read_index = index_;
    ack.process = heartbeat_t::RECORDER;
    ack.flushed_record = flushed_record_;
    publish(*bus_, channel::kAck, ack);
  }
  if (faults.estimator_runs && driven()) {
    estimate_t e = {};
    e.estimate_v1 = 1;
    e.boot_id = boot_id_;
    e.first_index = index_ - 300;
    e.last_index = index_;
    e.valid = 1;
    const bool stalls = faults.stalls || stalled_;
    e.steady = stalls ? 0 : 1;
    e.slip = stalls ? 0.99 : 0.01;
    publish(*bus_, channel::kEstimate, e);
  }
}

void ScriptedRig::tick(Moment now) {
  now_ = now;
  bridge_lease_.step(now);
  dyno_lease_.step(now);
  bus_->wait(0);
  if (!bridge_silent_ && !faults.dsp_absent) run_samples(kSamplesPerTick, now);
  publish_states(now);
}

}  // namespace imrig::test
