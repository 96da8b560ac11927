#pragma once
// How far may the device run ahead? To min(read_index of the live followers, samples received) + window. A
// follower is alive for a second after its last ACK; without followers only the bridge itself reads along.
// The horizon never moves backwards within one boot. Matters only where the device can wait
// (welcome_t.waits_for_credit); elsewhere it does no harm.

#include <cstdint>
#include <imrig_msg/ack_t.hpp>
#include <map>
#include <utility>

namespace imrig {

class CreditKeeper {
 public:
  explicit CreditKeeper(std::int64_t window_samples) : window_(window_samples) {}

  // A device that has just booted: whoever followed before follows from its first sample on.
  void new_boot(std::int64_t boot_id, std::int64_t next_index);
  // ACKs of another boot are passed over: an old log must not hold the rig up.
  void on_ack(const imrig_msg::ack_t& ack, std::int64_t now_us);
  // next_index: samples received so far. Returns the horizon.
  std::int64_t horizon(std::int64_t next_index, std::int64_t now_us);

 private:
  struct Follower {
    std::int64_t read_index = 0;
    std::int64_t heard_us = 0;
  };

  std::int64_t window_;
  std::int64_t boot_id_ = 0;
  std::int64_t horizon_ = 0;
  std::map<std::pair<std::int32_t, std::int32_t>, Follower> followers_;  // by process (heartbeat_t's constants) and pid
};

}  // namespace imrig
