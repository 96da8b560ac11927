#pragma once
// Zeros and noise of the sensors from the log itself: blocks with gates off for at least 50 ms and an encoder
// that does not move.
//
// Zero: mean over all samples of those blocks. Flux that still decays in the rotor induces a voltage in the
// open stator, so a block is left out when one of its means differs from the median block by more than 5
// standard errors, as long as most blocks stay. Noise: scatter within the blocks, per component of the space
// vector, so slow drift does not count. A converter with less noise than one count hides it; the figure never
// goes below that of rounding alone, 1/12 count^2 a phase, 2/3 of it a component.

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace imrig_msg {
class samples_t;
}

namespace imrig {

inline constexpr double kGatesOffSettle_s = 0.050;

enum Channel : std::size_t { kIa, kIb, kIc, kVa, kVb, kVc, kChannels };

struct SensorZero {
  std::array<double, kChannels> counts = {};  // 0 where nothing was found
  std::int64_t samples = 0;                   // that the zeros rest on
  double current_noise_A = 0.0;               // one sigma of a component; NaN where nothing was found
  double voltage_noise_V = 0.0;
};

// Of one boot of the device, us on its own clock.
struct ZeroWindow {
  std::int64_t from_utime = 0;
  std::int64_t to_utime = 0;
};

class ZeroCollector {
 public:
  // Every block of the log, in its order.
  void add(const imrig_msg::samples_t& block);

  // Over the blocks whose boot has a window and that begin within it, so that two logs of one measurement
  // agree although one began earlier or went on for longer; over all blocks where the windows hold too
  // little.
  SensorZero result(const std::map<std::int64_t, ZeroWindow>& by_boot) const;

 private:
  struct Block {
    std::int64_t boot_id = 0;
    std::int64_t utime = 0;
    std::int32_t n = 0;
    std::array<std::int64_t, kChannels> sum = {};
    double current_scatter_A2 = 0.0;  // sum of squares about the block's mean, of both components
    double voltage_scatter_V2 = 0.0;
    double current_A_per_count = 0.0;
    double voltage_V_per_count = 0.0;
  };
  static SensorZero zero_of(const std::vector<Block>& blocks);

  bool at_rest(const imrig_msg::samples_t& block);

  std::vector<Block> blocks_;
  // Of the stretch with gates off that the last block belongs to.
  bool off_ = false;
  std::int64_t off_since_ = 0;
  std::int64_t boot_id_ = 0;
  std::int64_t next_index_ = 0;
  std::int32_t last_encoder_ = 0;
};

}  // namespace imrig
