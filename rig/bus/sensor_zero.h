#pragma once
// Zeros and noise of the sensors from the log itself: blocks with gates off for at least 50 ms and an encoder
// that does not move.
//
// Flux that still decays in the rotor induces a voltage in the open stator, long after the gates opened: a
// rotor time constant of 0.3 s and 0.5 Wb make 0.06 V after a second. So the blocks are chosen in this order,
// the first choice with at least 4000 samples (a zero good to a sixtieth of the noise):
//   1. the rest that a campaign keeps for the zeros between its DATASET message and its first gates-on,
//   unless the
//      log shows gates on less than 1 s before. Logs that began or ended at different moments agree on it.
//   2. blocks after 2, 1, 0.5, 0.2 s with gates off, as far as the log shows
//   3. all.
// Zero: mean over their samples. A block is left out when one of its means differs from the median block by
// more than 5 standard errors, as long as most blocks stay. Noise: scatter within the blocks, per component
// of the space vector, so slow drift does not count. A converter with less noise than one count hides it; the
// figure never goes below that of rounding alone, 1/12 count^2 a phase, 2/3 of it a component.

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

namespace imrig_msg {
class samples_t;
}

namespace imrig {

enum Channel : std::size_t { kIa, kIb, kIc, kVa, kVb, kVc, kChannels };

struct SensorZero {
  std::array<double, kChannels> counts = {};                          // 0 where nothing was found
  std::int64_t samples = 0;                                           // that the zeros rest on
  double current_noise_A = std::numeric_limits<double>::quiet_NaN();  // one sigma of a component
  double voltage_noise_V = std::numeric_limits<double>::quiet_NaN();
};

class ZeroCollector {
 public:
  // Every block of the log, in its order.
  void add(const imrig_msg::samples_t& block);
  // A campaign has begun; rig time of its DATASET message, us.
  void campaign_begins(std::int64_t utime);

  SensorZero result() const;

 private:
  struct Block {
    std::int64_t boot_id = 0;
    std::int64_t utime = 0;
    std::int32_t n = 0;
    double off_s = 0.0;         // with gates off before this block, as far as the log shows
    bool opening_seen = false;  // and it shows when they opened, or has a gap there
    std::array<std::int64_t, kChannels> sum = {};
    double current_scatter_A2 = 0.0;  // sum of squares about the block's mean, of both components
    double voltage_scatter_V2 = 0.0;
    double current_A_per_count = 0.0;
    double voltage_V_per_count = 0.0;
  };
  using Blocks = std::vector<Block>;
  // From a campaign's begin to its first gates-on, us on the clock of one boot.
  struct Rest {
    std::int64_t boot_id = 0;
    std::int64_t from_utime = 0;
    std::int64_t to_utime = std::numeric_limits<std::int64_t>::max();
  };

  bool follow(const imrig_msg::samples_t& block);
  double off_s(const imrig_msg::samples_t& block) const;
  void end_rest(const imrig_msg::samples_t& block);
  bool in_campaign_rest(const Block& block) const;
  Blocks chosen() const;
  static void measure_noise(const Blocks& blocks, SensorZero& out);
  static std::vector<bool> outliers(const Blocks& blocks, const SensorZero& noise);

  Blocks blocks_;
  // Of the stretch with gates off that the last block belongs to.
  bool any_ = false;
  bool off_ = false;
  bool opening_seen_ = false;
  std::int64_t off_since_ = 0;
  std::int64_t boot_id_ = 0;
  std::int64_t next_index_ = 0;
  std::int32_t last_encoder_ = 0;
  std::vector<Rest> rests_;
};

}  // namespace imrig
