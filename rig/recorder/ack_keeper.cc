#include "rig/recorder/ack_keeper.h"

#include <algorithm>
#include <imrig_msg/heartbeat_t.hpp>

namespace imrig {

void AckKeeper::on_samples(const imrig_msg::samples_t& block) {
  constexpr std::int64_t kIndexLimit = std::int64_t{1} << 60;
  if (block.first_index < 0 || block.first_index > kIndexLimit) return;
  if (!seen_ || block.boot_id != boot_id_) {  // a new boot counts from its own zero
    read_index_ = acked_index_ = 0;
    blocks_ = kBlocks;
  }
  seen_ = true;
  boot_id_ = block.boot_id;
  read_index_ = std::max(read_index_, block.first_index + block.n);
  utime_ = block.utime;
  ++blocks_;
}

std::optional<imrig_msg::ack_t> AckKeeper::due(std::int64_t now_us, bool hold, std::int64_t lost,
                                               std::int32_t flushed_record) {
  if (!seen_ || (blocks_ < kBlocks && now_us - acked_us_ < kInterval_us)) return std::nullopt;
  if (hold && now_us - acked_us_ < kInterval_us) return std::nullopt;
  if (!hold) acked_index_ = read_index_;
  blocks_ = 0;
  acked_us_ = now_us;
  imrig_msg::ack_t ack = {};
  ack.utime = utime_;
  ack.seq = ++seq_;
  ack.ack_v1 = 1;
  ack.boot_id = boot_id_;
  ack.read_index = acked_index_;
  ack.lost_blocks = lost;
  ack.process = imrig_msg::heartbeat_t::RECORDER;
  ack.flushed_record = flushed_record;
  return ack;
}

}  // namespace imrig
