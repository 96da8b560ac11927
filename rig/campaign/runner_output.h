#pragma once
// What a running campaign emits: messages to publish and events for the journal, in this order.

#include <cstdint>
#include <imrig_msg/ack_t.hpp>
#include <imrig_msg/bridge_cmd_t.hpp>
#include <imrig_msg/campaign_status_t.hpp>
#include <imrig_msg/dataset_t.hpp>
#include <imrig_msg/dyno_cmd_t.hpp>
#include <imrig_msg/heartbeat_t.hpp>
#include <imrig_msg/lease_cmd_t.hpp>
#include <imrig_msg/record_t.hpp>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace imrig {

// What the journal is told.
struct RunnerEvent {
  enum Kind { kRecordBegun, kPointDone, kPointRetried, kPointFailed, kEnded } kind = kEnded;
  std::string id;
  int number = 0;
  int attempt = 0;
  std::int64_t samples = 0;
  std::string text;  // why
};

using RunnerOutput = std::variant<imrig_msg::bridge_cmd_t, imrig_msg::dyno_cmd_t, imrig_msg::lease_cmd_t,
                                  imrig_msg::record_t, imrig_msg::dataset_t, imrig_msg::campaign_status_t,
                                  imrig_msg::ack_t, imrig_msg::heartbeat_t, RunnerEvent>;

// Collects outputs between two steps.
class Outbox {
 public:
  // Fills the first two fields of a message.
  template <class Message>
  void stamp(Message& message, std::int64_t utime) {
    message.utime = utime;
    message.seq = ++seq_;
  }
  void emit(RunnerOutput output) { out_.push_back(std::move(output)); }
  std::vector<RunnerOutput> take() { return std::exchange(out_, {}); }

 private:
  std::vector<RunnerOutput> out_;
  std::int64_t seq_ = 0;
};

}  // namespace imrig
