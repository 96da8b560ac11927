#include "rig/bus/sensor_zero.h"

#include <algorithm>
#include <cmath>
#include <imrig_msg/samples_t.hpp>
#include <limits>

#include "rig/base/space_vector.h"

namespace imrig {

namespace {

// Variance of a component of the space vector, in counts^2, when each phase is rounded to whole counts.
constexpr double kRoundingVariance = (2.0 / 3.0) / 12.0;
constexpr double kOutlierErrors = 5.0;
constexpr std::array kSettle_s = {2.0, 1.0, 0.5, 0.2, 0.05};
constexpr double kCampaignSettle_s = 1.0;
constexpr std::int64_t kEnough = 4000;  // samples

struct Scatter {
  SpaceVector sum;
  double squares = 0.0;
  void add(SpaceVector x) {
    sum += x;
    squares += std::norm(x);
  }
  double about_mean(double n) const { return std::max(0.0, squares - std::norm(sum) / n); }
};

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

// Keeps track of the gates; true when the block can tell a zero.
bool ZeroCollector::follow(const imrig_msg::samples_t& block) {
  const bool same_boot = any_ && block.boot_id == boot_id_;
  const bool contiguous = same_boot && block.first_index == next_index_;
  const bool still = !contiguous || block.encoder.front() == last_encoder_;
  if (block.gates_on == 0 && !(off_ && contiguous)) {
    off_since_ = block.first_index;
    opening_seen_ = same_boot;  // a gap may hide that they were on
  }
  if (!rests_.empty()) end_rest(block);
  off_ = block.gates_on == 0;
  any_ = true;
  boot_id_ = block.boot_id;
  next_index_ = block.first_index + block.n;
  last_encoder_ = block.encoder.back();
  return off_ && still && off_s(block) >= kSettle_s.back() &&
         std::all_of(block.encoder.begin(), block.encoder.end(),
                     [&](std::int32_t c) { return c == last_encoder_; });
}

double ZeroCollector::off_s(const imrig_msg::samples_t& block) const {
  return static_cast<double>(block.first_index - off_since_) * static_cast<double>(block.sample_time_ns) *
         1e-9;
}

void ZeroCollector::campaign_begins(std::int64_t utime) { rests_.push_back({any_ ? boot_id_ : 0, utime}); }

void ZeroCollector::end_rest(const imrig_msg::samples_t& block) {
  Rest& rest = rests_.back();
  if (!any_) rest.boot_id = block.boot_id;  // the log's first samples come after the campaign's begin
  const bool open = rest.to_utime == std::numeric_limits<std::int64_t>::max();
  if (open && block.boot_id == rest.boot_id && block.gates_on != 0) rest.to_utime = block.utime;
}

bool ZeroCollector::in_campaign_rest(const Block& block) const {
  if (block.opening_seen && block.off_s < kCampaignSettle_s) return false;
  return std::any_of(rests_.begin(), rests_.end(), [&](const Rest& rest) {
    return rest.boot_id == block.boot_id && block.utime >= rest.from_utime && block.utime < rest.to_utime;
  });
}

void ZeroCollector::add(const imrig_msg::samples_t& block) {
  if (!follow(block)) return;
  Block out;
  out.boot_id = block.boot_id;
  out.utime = block.utime;
  out.n = block.n;
  out.off_s = off_s(block);
  out.opening_seen = opening_seen_;
  out.current_A_per_count = static_cast<double>(block.current_A_per_count);
  out.voltage_V_per_count = static_cast<double>(block.voltage_V_per_count);
  Scatter current;
  Scatter voltage;
  for (std::size_t k = 0; k < static_cast<std::size_t>(block.n); ++k) {
    const std::array<std::int16_t, kChannels> x = {block.i_a[k], block.i_b[k], block.i_c[k],
                                                   block.v_a[k], block.v_b[k], block.v_c[k]};
    for (std::size_t c = 0; c < kChannels; ++c) out.sum[c] += x[c];
    current.add(space_vector(x[kIa], x[kIb], x[kIc]));
    voltage.add(space_vector(x[kVa], x[kVb], x[kVc]));
  }
  out.current_scatter_A2 = out.current_A_per_count * out.current_A_per_count * current.about_mean(out.n);
  out.voltage_scatter_V2 = out.voltage_V_per_count * out.voltage_V_per_count * voltage.about_mean(out.n);
  blocks_.push_back(out);
}

ZeroCollector::Blocks ZeroCollector::chosen() const {
  const auto select = [this](auto&& wanted) {
    Blocks some;
    std::int64_t samples = 0;
    for (const auto& block : blocks_) {
      if (!wanted(block)) continue;
      some.push_back(block);
      samples += block.n;
    }
    if (samples < kEnough) some.clear();
    return some;
  };
  Blocks some = select([this](const Block& b) { return in_campaign_rest(b); });
  for (const double settle_s : kSettle_s) {
    if (some.empty()) some = select([&](const Block& b) { return b.off_s >= settle_s; });
  }
  return some.empty() ? blocks_ : some;
}

// Pooled over the blocks, about each block's own mean.
void ZeroCollector::measure_noise(const Blocks& blocks, SensorZero& out) {
  double freedom = 0.0;
  double current_A2 = 0.0;
  double voltage_V2 = 0.0;
  for (const auto& b : blocks) {
    freedom += 2.0 * (b.n - 1);
    current_A2 += b.current_scatter_A2;
    voltage_V2 += b.voltage_scatter_V2;
  }
  const auto sigma = [&](double squares, double per_count) {
    return std::sqrt(std::max(squares / std::max(freedom, 1.0), per_count * per_count * kRoundingVariance));
  };
  out.current_noise_A = sigma(current_A2, blocks.front().current_A_per_count);
  out.voltage_noise_V = sigma(voltage_V2, blocks.front().voltage_V_per_count);
}

std::vector<bool> ZeroCollector::outliers(const Blocks& blocks, const SensorZero& noise) {
  std::vector<bool> out(blocks.size(), false);
  const double phase_per_component = std::sqrt(1.5);
  for (std::size_t c = 0; c < kChannels; ++c) {
    std::vector<double> means;
    for (const auto& b : blocks) means.push_back(static_cast<double>(b.sum[c]) / b.n);
    const double middle = median(means);
    const double sigma =
        phase_per_component * (c < kVa ? noise.current_noise_A / blocks.front().current_A_per_count
                                       : noise.voltage_noise_V / blocks.front().voltage_V_per_count);
    for (std::size_t k = 0; k < blocks.size(); ++k) {
      if (std::abs(means[k] - middle) > kOutlierErrors * sigma / std::sqrt(blocks[k].n)) out[k] = true;
    }
  }
  const auto found = static_cast<std::size_t>(std::count(out.begin(), out.end(), true));
  if (2 * found > blocks.size()) out.assign(blocks.size(), false);
  return out;
}

SensorZero ZeroCollector::result() const {
  SensorZero out;
  const Blocks blocks = chosen();
  if (blocks.empty()) return out;
  measure_noise(blocks, out);
  const std::vector<bool> left_out = outliers(blocks, out);
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    if (left_out[k]) continue;
    out.samples += blocks[k].n;
    for (std::size_t c = 0; c < kChannels; ++c) out.counts[c] += static_cast<double>(blocks[k].sum[c]);
  }
  for (auto& zero : out.counts) zero /= static_cast<double>(out.samples);
  return out;
}

}  // namespace imrig
