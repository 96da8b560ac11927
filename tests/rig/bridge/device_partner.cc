#include "tests/rig/bridge/device_partner.h"

#include <array>

#include "rig/base/clock.h"

namespace imrig {

namespace {

constexpr std::int64_t kSample_us = 60;
constexpr std::int64_t kMostAtOnce = 5000;  // after a pause of the thread the rest of its time is dropped

imrig_device_config device_config(bool waits) {
  imrig_device_config config = {};
  config.boot_id = random_id();
  config.sample_time_ns = kSample_us * 1000;
  config.pwm_samples = 4;
  config.current_A_per_count = 0.025f;
  config.voltage_V_per_count = 0.2f;
  config.full_scale_counts = 2047;
  config.encoder_counts_per_rev = 4096;
  config.waits_for_credit = waits ? 1 : 0;
  return config;
}

}  // namespace

DevicePartner::DevicePartner(bool at_max_pace)
    : at_max_pace_(at_max_pace),
      transport_(open_transport("udp-listen://127.0.0.1:0")),
      started_us_(monotonic_us()) {
  const imrig_device_config config = device_config(at_max_pace);
  imrig_device_init(&device_, &config);
  thread_ = std::thread([this] { live(); });
}

DevicePartner::~DevicePartner() {
  stop_ = true;
  thread_.join();
}

std::int64_t DevicePartner::sent_us(std::int64_t first_index) {
  const std::lock_guard lock(mutex_);
  const auto found = sent_.find(first_index);
  return found == sent_.end() ? 0 : found->second;
}

void DevicePartner::live() {
  while (!stop_) {
    const bool busy = at_max_pace_ && !mute && imrig_device_may_sample(&device_) != 0;
    transport_->wait(busy ? 0 : 1);
    const std::int64_t now_us = monotonic_us();
    hear(now_us / 1000);
    take_samples(now_us);
    imrig_device_tick(&device_, now_us / 1000);
    say();
    const bool on = device_.drive.command.legs != 0 && imrig_device_must_be_off(&device_) == 0;
    if (gates_on && !on) gates_off_us = monotonic_us();
    trip = device_.trip;  // before the gates, for whoever waits for these
    gates_on = on;
    next_index = device_.next_index;
  }
}

void DevicePartner::hear(std::int64_t now_ms) {
  std::array<std::uint8_t, 65536> buffer;
  while (const std::size_t n = transport_->read(buffer)) {
    if (transport_->from_stranger()) transport_->accept_sender();
    if (!mute) imrig_device_feed(&device_, buffer.data(), n, now_ms);
  }
}

void DevicePartner::say() {
  std::array<std::uint8_t, IMRIG_FRAME_MAX> frame;
  for (;;) {
    const imrig_block* block = imrig_blocks_first(&device_.blocks);
    const std::int64_t first_index = block != nullptr ? block->first_index : -1;
    const std::size_t n = imrig_device_take(&device_, frame.data(), frame.size());
    if (n == 0) return;
    if (first_index >= 0 && imrig_blocks_first(&device_.blocks) != block) {
      const std::lock_guard lock(mutex_);
      sent_[first_index] = monotonic_us();
    }
    if (!mute) transport_->write({frame.data(), n});
  }
}

void DevicePartner::take_samples(std::int64_t now_us) {
  imrig_counts counts = {};
  counts.stator_C = stator_C;
  const std::int64_t due = at_max_pace_ ? kMostAtOnce : (now_us - started_us_) / kSample_us;
  for (std::int64_t k = 0; k < due && k < kMostAtOnce && imrig_device_may_sample(&device_) != 0; ++k) {
    counts.i[0] = static_cast<std::int16_t>(device_.next_index % 100);
    imrig_device_sample(&device_, &counts);
    say();
  }
  if (!at_max_pace_) started_us_ += due * kSample_us;
}

}  // namespace imrig
