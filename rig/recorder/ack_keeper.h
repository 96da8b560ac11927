#pragma once
// When the recorder acknowledges samples: every 4 blocks, else every 20 ms, and again every 20 ms while
// nothing comes, so that the bridge keeps it as a follower and the campaign hears of records on disk. The
// read index stands still while too much waits to be written: a device that can wait then waits for the disk.

#include <cstdint>
#include <imrig_msg/ack_t.hpp>
#include <imrig_msg/samples_t.hpp>
#include <optional>

namespace imrig {

class AckKeeper {
 public:
  static constexpr int kBlocks = 4;
  static constexpr std::int64_t kInterval_us = 20000;

  void on_samples(const imrig_msg::samples_t& block);
  // lost and flushed_record travel along. Nothing before the first block, and when none is due.
  std::optional<imrig_msg::ack_t> due(std::int64_t now_us, bool hold, std::int64_t lost,
                                      std::int32_t flushed_record);

  std::int64_t utime() const { return utime_; }  // us, rig time of the last sample

 private:
  bool seen_ = false;
  int blocks_ = 0;
  std::int64_t boot_id_ = 0;
  std::int64_t read_index_ = 0;
  std::int64_t acked_index_ = 0;
  std::int64_t acked_us_ = 0;
  std::int64_t utime_ = 0;
  std::int64_t seq_ = 0;
};

}  // namespace imrig
