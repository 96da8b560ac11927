#pragma once
// Rig time and mean mechanical speed from the encoder counts of the sample stream, over stretches of at least
// 20 ms.

#include <cstdint>
#include <imrig_msg/samples_t.hpp>
#include <limits>

namespace imrig {

class ShaftSpeed {
 public:
  // A new boot_id starts anew; blocks that lie before what was seen are passed over.
  void take(const imrig_msg::samples_t& samples);

  bool seen() const { return seen_; }
  std::int64_t utime() const { return utime_; }  // us, of the newest sample; 0 before the first
  std::int64_t boot_id() const { return boot_id_; }
  double rpm() const { return rpm_; }  // NaN until 20 ms have been seen

 private:
  bool seen_ = false;
  std::int64_t boot_id_ = 0;
  std::int64_t next_index_ = 0;
  std::int64_t utime_ = 0;
  std::int64_t anchor_index_ = 0;
  std::int32_t anchor_count_ = 0;
  double rpm_ = std::numeric_limits<double>::quiet_NaN();
};

}  // namespace imrig
