#include "rig/campaign/sample_watch.h"

namespace imrig {

namespace {

constexpr std::int64_t kStill_ns = 300'000'000;
constexpr std::int64_t kAckSamples = 1024;
constexpr std::int64_t kAck_us = 20'000;
constexpr std::int64_t kAckAgain_us = 250'000;  // keeps this follower alive while nothing comes

}  // namespace

void SampleWatch::on(const imrig_msg::samples_t& block, std::int64_t steady_us) {
  if (block.n < 1 || block.sample_time_ns < 1) return;
  if (boot_id_ != 0 && block.boot_id != boot_id_) rebooted_ = true;
  const bool gap = next_seq_ >= 0 && block.seq != next_seq_;
  if (gap && block.seq > next_seq_) lost_blocks_ += block.seq - next_seq_;
  boot_id_ = block.boot_id;
  next_seq_ = block.seq + 1;
  sample_time_ns_ = block.sample_time_ns;
  heard_us_ = steady_us;
  follow_shaft(block);
  next_index_ = block.first_index + block.n;
  utime_ = (next_index_ - 1) * sample_time_ns_ / 1000;
  if (profile_start_ < 0 && profile_id_ != 0 && block.profile_id == profile_id_)
    profile_start_ = block.first_index;
  if (record_ != 0 && block.record == record_) {
    if (record_end_ >= 0 && block.first_index != record_end_) record_unbroken_ = false;
    record_samples_ += block.n;
    record_end_ = next_index_;
  }
}

void SampleWatch::follow_shaft(const imrig_msg::samples_t& block) {
  gates_on_ = block.gates_on != 0;
  for (std::int32_t k = 0; k < block.n; ++k) {
    const auto moved =
        static_cast<std::int32_t>(static_cast<std::uint32_t>(block.encoder[static_cast<std::size_t>(k)]) -
                                  static_cast<std::uint32_t>(still_count_));  // counts wrap at 2^32
    if (moved >= -1 && moved <= 1) continue;
    still_count_ = block.encoder[static_cast<std::size_t>(k)];
    still_since_ = block.first_index + k;
  }
}

void SampleWatch::expect_profile(std::int32_t profile_id) {
  profile_id_ = profile_id;
  profile_start_ = -1;
}

void SampleWatch::expect_record(std::int32_t number) {
  record_ = number;
  record_samples_ = 0;
  record_end_ = -1;
  record_unbroken_ = true;
}

bool SampleWatch::at_rest() const {
  return seen() && !gates_on_ && (next_index_ - still_since_) * sample_time_ns_ > kStill_ns;
}

std::optional<std::int64_t> SampleWatch::acknowledge(std::int64_t steady_us) {
  if (!seen()) return std::nullopt;
  const std::int64_t waited = steady_us - acknowledged_us_;
  const bool much = next_index_ - acknowledged_ >= kAckSamples;
  const bool some = next_index_ != acknowledged_ && waited >= kAck_us;
  if (!much && !some && waited < kAckAgain_us) return std::nullopt;
  acknowledged_ = next_index_;
  acknowledged_us_ = steady_us;
  return next_index_;
}

}  // namespace imrig
