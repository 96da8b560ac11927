#include "estimators/online/operating_point.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "estimators/online/steady_criterion.h"
#include "estimators/online/window_analysis.h"
#include "estimators/online/window_buffer.h"
#include "rig/base/error.h"
#include "rig/base/space_vector.h"

namespace imrig::est {

namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr std::int64_t kShortestSample_ns = 5'000;
constexpr std::int64_t kLongestSample_ns = 10'000'000;
constexpr std::int64_t kLatest_ns = std::int64_t{1} << 62;
constexpr double kMostSamples = 1 << 20;

bool same_length(const SampleBlock& b) {
  const std::size_t n = b.encoder.size();
  return n > 0 && b.i_a.size() == n && b.i_b.size() == n && b.i_c.size() == n && b.v_a.size() == n &&
         b.v_b.size() == n && b.v_c.size() == n;
}

bool sound(const SampleBlock& b) {
  return same_length(b) && b.sample_time_ns >= kShortestSample_ns && b.sample_time_ns <= kLongestSample_ns &&
         b.first_index >= 0 && b.first_index <= kLatest_ns / b.sample_time_ns &&
         std::isfinite(b.current_A_per_count) && std::isfinite(b.voltage_V_per_count) &&
         b.voltage_filter_s >= 0.0 && b.voltage_filter_s <= 1.0;
}

void check(const OperatingPointConfig& c) {
  if (c.pole_pairs < 1) throw Error("operating point", "pole pairs must be at least 1");
  if (!(c.window_s >= 0.01 && c.window_s <= 10.0))
    throw Error("operating point", "window must be 0.01 to 10 s");
  if (!(c.lowest_Hz >= 0.05 && c.lowest_Hz <= 1000.0))
    throw Error("operating point", "lowest frequency must be 0.05 to 1000 Hz");
  if (!(c.least_voltage_V > 0.0)) throw Error("operating point", "least voltage must be above 0 V");
}

}  // namespace

class OperatingPointEstimator::Impl {
 public:
  Impl(const OperatingPointConfig& config, Sink sink) : config_(config), sink_(std::move(sink)) {
    check(config_);
  }

  bool feed(const SampleBlock& block) {
    if (!sound(block)) return false;
    if (!started_ || block.boot_id != boot_id_ || block.sample_time_ns != sample_time_ns_) start(block);
    if (block.first_index < next_index_) return false;
    if (block.first_index > next_index_) {
      gaps_ += block.first_index - next_index_;
      restart(block.first_index);
    }
    if (!same_channel(block)) {
      restart(block.first_index);
      take_channel(block);
    }
    for (std::size_t k = 0; k < block.encoder.size(); ++k) take(block, k);
    return true;
  }

  std::size_t least_to_end() const { return started_ ? try_at_ - std::min(buffer_.size(), try_at_) : 0; }
  std::int64_t boot_id() const { return boot_id_; }
  std::int64_t read_index() const { return next_index_; }

 private:
  // What holds for a whole window: gates, scales, filter.
  bool same_channel(const SampleBlock& b) const {
    return b.gates_on == gates_on_ && b.current_A_per_count == current_scale_ &&
           b.voltage_V_per_count == voltage_scale_ && b.voltage_filter_s == facts_.voltage_filter_s &&
           b.encoder_counts_per_rev == facts_.encoder_counts_per_rev;
  }

  void take_channel(const SampleBlock& b) {
    gates_on_ = b.gates_on;
    current_scale_ = b.current_A_per_count;
    voltage_scale_ = b.voltage_V_per_count;
    facts_.voltage_filter_s = b.voltage_filter_s;
    facts_.encoder_counts_per_rev = b.encoder_counts_per_rev;
  }

  void start(const SampleBlock& block) {
    const bool other_rate = !started_ || block.sample_time_ns != sample_time_ns_;
    started_ = true;
    boot_id_ = block.boot_id;
    sample_time_ns_ = block.sample_time_ns;
    facts_.sample_time_s = 1e-9 * static_cast<double>(sample_time_ns_);
    facts_.pole_pairs = config_.pole_pairs;
    facts_.voltage_held = config_.voltage_held;
    facts_.leakage_H = config_.voltage_held ? config_.leakage_H : 0.0;
    const auto samples = [this](double s) {
      return static_cast<std::size_t>(std::clamp(std::round(s / facts_.sample_time_s), 8.0, kMostSamples));
    };
    window_ = samples(config_.window_s);
    longest_ = std::max(window_, samples((kLeastPeriods + 0.5) / config_.lowest_Hz));
    if (other_rate) buffer_.reserve(longest_ + 1);
    gaps_ = 0;
    next_index_ = block.first_index;
    take_channel(block);
    restart(block.first_index);
  }

  void restart(std::int64_t index) {
    buffer_.clear();
    try_at_ = window_;
    next_index_ = first_index_ = index;
  }

  void take(const SampleBlock& b, std::size_t k) {
    buffer_.push(voltage_scale_ * space_vector(b.v_a[k], b.v_b[k], b.v_c[k]),
                 current_scale_ * space_vector(b.i_a[k], b.i_b[k], b.i_c[k]), b.encoder[k]);
    ++next_index_;
    if (buffer_.size() >= try_at_) close_window();
  }

  // At fixed fillings, whatever the blocks: looks for a fundamental, and waits for twice as much if there is
  // none.
  void close_window() {
    if (!gates_on_) return emit(buffer_.size(), std::nullopt);
    const auto frequency = find_frequency(buffer_.v(), config_.least_voltage_V);
    if (frequency) return emit(frequency->samples, frequency);
    if (try_at_ >= longest_) return emit(buffer_.size(), std::nullopt);
    try_at_ = std::min(try_at_ + try_at_ / 4, longest_);
  }

  void emit(std::size_t n, const std::optional<WindowFrequency>& frequency) {
    OperatingPoint out;
    out.boot_id = boot_id_;
    out.first_index = first_index_;
    out.last_index = first_index_ + static_cast<std::int64_t>(n) - 1;
    out.utime = out.last_index * sample_time_ns_ / 1000;
    out.gaps = std::exchange(gaps_, 0);
    out.valid = frequency && analyse_electrical(buffer_, *frequency, facts_, out);
    if (!out.valid)
      out.frequency_Hz = out.voltage_V = out.current_A = out.phi_rad = out.input_power_W = kNone;
    analyse_speed(buffer_, n, facts_, out);
    out.steady = steady_.take(out);
    out.moved = steady_.moved();
    buffer_.drop(n);
    first_index_ = out.last_index + 1;
    try_at_ = window_;
    sink_(out);
  }

  OperatingPointConfig config_;
  Sink sink_;
  SteadyCriterion steady_;
  WindowBuffer buffer_;
  WindowFacts facts_;
  bool started_ = false;
  bool gates_on_ = false;
  double current_scale_ = 0.0, voltage_scale_ = 0.0;
  std::int64_t boot_id_ = 0;
  std::int64_t sample_time_ns_ = 0;
  std::int64_t first_index_ = 0;  // of the buffer's first sample
  std::int64_t next_index_ = 0;
  std::int64_t gaps_ = 0;
  std::size_t window_ = 0, longest_ = 0, try_at_ = 0;
};

OperatingPointEstimator::OperatingPointEstimator(const OperatingPointConfig& config, Sink sink)
    : impl_(std::make_unique<Impl>(config, std::move(sink))) {}
OperatingPointEstimator::~OperatingPointEstimator() = default;
bool OperatingPointEstimator::feed(const SampleBlock& block) { return impl_->feed(block); }
std::int64_t OperatingPointEstimator::boot_id() const { return impl_->boot_id(); }
std::size_t OperatingPointEstimator::least_to_end() const { return impl_->least_to_end(); }
std::int64_t OperatingPointEstimator::read_index() const { return impl_->read_index(); }

}  // namespace imrig::est
