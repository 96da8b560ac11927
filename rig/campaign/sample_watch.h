#pragma once
// What a campaign reads from the stream of samples: how far the rig's clock is, where a profile began,
// whether a record is whole, whether the shaft rests.

#include <cstdint>
#include <imrig_msg/samples_t.hpp>
#include <optional>

namespace imrig {

class SampleWatch {
 public:
  void on(const imrig_msg::samples_t& block, std::int64_t steady_us);

  bool seen() const { return boot_id_ != 0; }
  bool rebooted() const { return rebooted_; }  // the device's clock restarted since the first block
  std::int64_t boot_id() const { return boot_id_; }
  std::int64_t next_index() const { return next_index_; }
  std::int64_t sample_time_ns() const { return sample_time_ns_; }
  std::int64_t utime() const { return utime_; }  // us, of the last sample
  std::int64_t heard_us() const { return heard_us_; }
  std::int64_t lost_blocks() const { return lost_blocks_; }

  // The index of the first sample seen of a profile; -1 before.
  void expect_profile(std::int32_t profile_id);
  std::int64_t profile_start() const { return profile_start_; }

  // Samples of one record.
  void expect_record(std::int32_t number);
  std::int64_t record_samples() const { return record_samples_; }
  bool record_unbroken() const { return record_unbroken_; }
  std::int64_t record_end() const { return record_end_; }  // one past its last sample

  // Gates off, and no encoder count moved by more than one during the last 0.3 s.
  bool at_rest() const;

  // The index to acknowledge: every 4 blocks' worth of samples, and at least every 20 ms while samples come.
  std::optional<std::int64_t> acknowledge(std::int64_t steady_us);

 private:
  void follow_shaft(const imrig_msg::samples_t& block);

  std::int64_t boot_id_ = 0;
  bool rebooted_ = false;
  std::int64_t next_index_ = 0;
  std::int64_t sample_time_ns_ = 60000;
  std::int64_t utime_ = 0;
  std::int64_t heard_us_ = 0;
  std::int64_t next_seq_ = -1;
  std::int64_t lost_blocks_ = 0;
  std::int32_t profile_id_ = 0;
  std::int64_t profile_start_ = -1;
  std::int32_t record_ = 0;
  std::int64_t record_samples_ = 0;
  std::int64_t record_end_ = -1;
  bool record_unbroken_ = true;
  bool gates_on_ = true;
  std::int32_t still_count_ = 0;  // encoder count that the shaft has stayed at
  std::int64_t still_since_ = 0;  // since this index
  std::int64_t acknowledged_ = -1;
  std::int64_t acknowledged_us_ = 0;
};

}  // namespace imrig
