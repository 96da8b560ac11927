#include "plant/firmware.h"

#include <algorithm>

namespace imrig::plant {

namespace {

imrig_device_config device_config(const Plant& plant, std::int64_t boot_id, bool waits_for_credit) {
  const SensorScale scale = plant.scale();
  imrig_device_config config = {};
  config.boot_id = boot_id;
  config.sample_time_ns = plant.sample_time_ns();
  config.pwm_samples = static_cast<std::int32_t>(plant.pwm_time_ns() / plant.sample_time_ns());
  config.current_A_per_count = static_cast<float>(scale.current_A_per_count);
  config.voltage_V_per_count = static_cast<float>(scale.voltage_V_per_count);
  config.voltage_filter_s = static_cast<float>(scale.voltage_filter_s);
  config.full_scale_counts = scale.full_scale_counts;
  config.encoder_counts_per_rev = scale.encoder_counts_per_rev;
  config.waits_for_credit = waits_for_credit ? 1 : 0;
  return config;
}

}  // namespace

Firmware::Firmware(const Plant& plant, std::int64_t boot_id, bool waits_for_credit)
    : device_(std::make_unique<imrig_device>()) {
  const imrig_device_config config = device_config(plant, boot_id, waits_for_credit);
  imrig_device_init(device_.get(), &config);
}

void Firmware::feed(std::span<const std::uint8_t> bytes, std::int64_t now_ms) {
  imrig_device_feed(device_.get(), bytes.data(), bytes.size(), now_ms);
}

void Firmware::tick(std::int64_t now_ms) { imrig_device_tick(device_.get(), now_ms); }
bool Firmware::has_output() const { return imrig_device_has_output(device_.get()) != 0; }

std::size_t Firmware::take(std::span<std::uint8_t> buffer) {
  return imrig_device_take(device_.get(), buffer.data(), buffer.size());
}

bool Firmware::welcomed() const { return device_->welcomed != 0; }
std::int64_t Firmware::host_nonce() const { return device_->welcomed != 0 ? device_->host.host_nonce : 0; }
bool Firmware::may_sample() const { return imrig_device_may_sample(device_.get()) != 0; }
std::int64_t Firmware::next_index() const { return device_->next_index; }

InverterCommand Firmware::command() const {
  InverterCommand command;
  if (imrig_device_must_be_off(device_.get()) != 0 || acting_.legs == 0) return command;
  std::copy(std::begin(acting_.v_V), std::end(acting_.v_V), std::begin(command.v));
  command.gates_on = true;
  return command;
}

void Firmware::sample(const RawSample& raw) {
  imrig_counts counts = {};
  std::copy(std::begin(raw.i), std::end(raw.i), std::begin(counts.i));
  std::copy(std::begin(raw.v), std::end(raw.v), std::begin(counts.v));
  counts.encoder = raw.encoder;
  counts.stator_C = raw.stator_C;
  acting_ = next_;
  next_ = imrig_device_sample(device_.get(), &counts);
}

}  // namespace imrig::plant
