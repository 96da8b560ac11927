#pragma once
// The estimator between two messages: samples_t in, the bytes of estimate_t and motor_estimate_t out. Buffers are
// kept, so that a block of samples costs no allocation once the sample time is known. Knows no bus: its caller
// decodes, and names the channels.

#include <cstdint>
#include <functional>
#include <imrig_msg/samples_t.hpp>
#include <span>
#include <vector>

#include "estimators/online/estimate_message.h"

namespace imrig::est {

class EstimatorNode {
 public:
  enum class Kind { kPoint, kMotor };
  // The bytes are good during the call.
  using Out = std::function<void(Kind kind, std::span<const std::uint8_t> data)>;

  EstimatorNode(const EstimatorConfig& config, Out out)
      : out_(std::move(out)), estimator_(config, [this](const MotorEstimate& e) { publish(e); }) {}

  // One block of samples; a malformed one is passed over: false.
  bool take(const imrig_msg::samples_t& m) {
    if (m.n < 1 || m.first_index < 0 || m.first_index > kMostIndex || m.seq < 0 || m.seq > kMostIndex) return false;
    if (!following_ || m.boot_id != boot_id_) {
      following_ = true;
      boot_id_ = m.boot_id;
      read_index_ = 0;
    } else if (m.seq > next_block_) {
      lost_blocks_ += m.seq - next_block_;
    }
    next_block_ = m.seq + 1;
    utime_ = m.utime;
    estimator_.feed(block_of(m));
    read_index_ = std::max(read_index_, m.first_index + m.n);
    return true;
  }

  bool following() const { return following_; }
  std::int64_t boot_id() const { return boot_id_; }
  std::int64_t read_index() const { return read_index_; }
  std::int64_t lost_blocks() const { return lost_blocks_; }
  std::int64_t utime() const { return utime_; }  // us, rig time of the newest block
  std::int64_t estimates() const { return seq_; }

 private:
  static constexpr std::int64_t kMostIndex = std::int64_t{1} << 62;

  void publish(const MotorEstimate& e) {
    send(Kind::kMotor, message_of(e, ++seq_), motor_bytes_);
    if (e.window) send(Kind::kPoint, message_of(e.point, ++point_seq_), point_bytes_);
  }
  template <class Message>
  void send(Kind kind, const Message& m, std::vector<std::uint8_t>& bytes) {
    m.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    out_(kind, bytes);
  }
  // Both types have one size.
  template <class Message>
  static std::vector<std::uint8_t> room() {
    return std::vector<std::uint8_t>(static_cast<std::size_t>(Message{}.getEncodedSize()));
  }

  Out out_;
  std::vector<std::uint8_t> point_bytes_ = room<imrig_msg::estimate_t>(), motor_bytes_ = room<imrig_msg::motor_estimate_t>();
  bool following_ = false;
  std::int64_t boot_id_ = 0, next_block_ = 0, read_index_ = 0, lost_blocks_ = 0, utime_ = 0, seq_ = 0, point_seq_ = 0;
  Estimator estimator_;
};

}  // namespace imrig::est
