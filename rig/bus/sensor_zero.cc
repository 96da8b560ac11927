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

// Also keeps track of when the gates opened; a gap may hide that they were on.
bool ZeroCollector::at_rest(const imrig_msg::samples_t& block) {
  const bool contiguous = block.boot_id == boot_id_ && block.first_index == next_index_;
  const bool still = !contiguous || block.encoder.front() == last_encoder_;
  if (block.gates_on == 0 && !(off_ && contiguous)) off_since_ = block.first_index;
  off_ = block.gates_on == 0;
  boot_id_ = block.boot_id;
  next_index_ = block.first_index + block.n;
  last_encoder_ = block.encoder.back();
  if (!off_ || !still) return false;
  const double off_s =
      static_cast<double>(block.first_index - off_since_) * static_cast<double>(block.sample_time_ns) * 1e-9;
  return off_s >= kGatesOffSettle_s && std::all_of(block.encoder.begin(), block.encoder.end(),
                                                   [&](std::int32_t c) { return c == last_encoder_; });
}

void ZeroCollector::add(const imrig_msg::samples_t& block) {
  if (!at_rest(block)) return;
  Block out;
  out.boot_id = block.boot_id;
  out.utime = block.utime;
  out.n = block.n;
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
  const double i_scale = out.current_A_per_count * out.current_A_per_count;
  const double v_scale = out.voltage_V_per_count * out.voltage_V_per_count;
  out.current_scatter_A2 = i_scale * current.about_mean(out.n);
  out.voltage_scatter_V2 = v_scale * voltage.about_mean(out.n);
  blocks_.push_back(out);
}

SensorZero ZeroCollector::result(const std::map<std::int64_t, ZeroWindow>& by_boot) const {
  constexpr std::int64_t kEnough = 4000;  // samples: the zero is then good to a sixtieth of the noise
  std::vector<Block> chosen;
  std::int64_t samples = 0;
  for (const auto& block : blocks_) {
    const auto window = by_boot.find(block.boot_id);
    if (window == by_boot.end() || block.utime < window->second.from_utime ||
        block.utime > window->second.to_utime)
      continue;
    chosen.push_back(block);
    samples += block.n;
  }
  return zero_of(samples < kEnough ? blocks_ : chosen);
}

SensorZero ZeroCollector::zero_of(const std::vector<Block>& blocks) {
  SensorZero out;
  out.current_noise_A = out.voltage_noise_V = std::numeric_limits<double>::quiet_NaN();
  if (blocks.empty()) return out;
  std::vector<bool> keep(blocks.size(), true);
  double freedom = 0.0;
  double current_A2 = 0.0;
  double voltage_V2 = 0.0;
  for (const auto& b : blocks) {
    freedom += 2.0 * (b.n - 1);
    current_A2 += b.current_scatter_A2;
    voltage_V2 += b.voltage_scatter_V2;
  }
  const double i_scale = blocks.front().current_A_per_count;
  const double v_scale = blocks.front().voltage_V_per_count;
  const double per_component = std::max(freedom, 1.0);
  const double current_var = std::max(current_A2 / per_component, i_scale * i_scale * kRoundingVariance);
  const double voltage_var = std::max(voltage_V2 / per_component, v_scale * v_scale * kRoundingVariance);
  out.current_noise_A = std::sqrt(current_var);
  out.voltage_noise_V = std::sqrt(voltage_var);

  std::size_t kept = blocks.size();
  for (std::size_t c = 0; c < kChannels; ++c) {
    std::vector<double> means;
    for (const auto& b : blocks) means.push_back(static_cast<double>(b.sum[c]) / b.n);
    const double middle = median(means);
    // Of a phase, in counts: 3/2 of a component's variance.
    const double variance =
        1.5 * (c < kVa ? current_var / (i_scale * i_scale) : voltage_var / (v_scale * v_scale));
    for (std::size_t k = 0; k < blocks.size(); ++k) {
      if (keep[k] && std::abs(means[k] - middle) > kOutlierErrors * std::sqrt(variance / blocks[k].n)) {
        keep[k] = false;
        --kept;
      }
    }
  }
  const bool all = 2 * kept < blocks.size();
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    if (!keep[k] && !all) continue;
    out.samples += blocks[k].n;
    for (std::size_t c = 0; c < kChannels; ++c) out.counts[c] += static_cast<double>(blocks[k].sum[c]);
  }
  for (auto& zero : out.counts) zero /= static_cast<double>(out.samples);
  return out;
}

}  // namespace imrig
