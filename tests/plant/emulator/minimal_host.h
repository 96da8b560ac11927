#pragma once
// The least a host does: says hello, grants credit, keeps the blocks.

#include <array>
#include <complex>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "rig/base/clock.h"
#include "rig/base/space_vector.h"
#include "rig/link/device/result.h"
#include "rig/link/host.h"
#include "rig/link/transport.h"

namespace imrig::test {

class MinimalHost {
 public:
  explicit MinimalHost(const std::string& url, int watchdog_ms = 2000)
      : transport_(open_transport(url)), link(config(watchdog_ms)), buffer_(65536) {}

  void turn(int wait_ms = 1) {
    while (const std::size_t n = transport_->read(buffer_)) link.receive({buffer_.data(), n}, monotonic_us());
    while (auto event = link.next_event()) {
      if (const auto* answer = std::get_if<LinkAnswer>(&*event)) answers[answer->request] = answer->result;
      if (const auto* block = std::get_if<LinkBlock>(&*event)) blocks.push_back(block->message);
      if (const auto* told = std::get_if<LinkStatus>(&*event)) status = told->message;
    }
    link.grant(std::min(link.next_index() + 64 * 256, credit_end));
    link.poll(monotonic_us());
    std::vector<std::uint8_t> packet;
    while (link.next_output(packet)) transport_->write(packet);
    transport_->wait(wait_ms);
  }

  bool until(const std::function<bool()>& condition, int timeout_s = 60) {
    const std::int64_t deadline = monotonic_us() + timeout_s * std::int64_t{1000000};
    while (!condition() && monotonic_us() < deadline) turn();
    return condition();
  }
  bool connect() {
    return until([&] { return link.up(); });
  }
  // The device's result, or -99 when there is none within the time.
  std::int32_t result_of(std::int64_t request) {
    until([&] { return answers.contains(request); });
    return answers.contains(request) ? answers[request] : -99;
  }
  bool reach(std::int64_t index) {
    return until([&] { return link.next_index() >= index; });
  }

 private:
  static LinkHostConfig config(int watchdog_ms) {
    LinkHostConfig config;
    config.host_nonce = random_id();
    config.watchdog_ms = watchdog_ms;
    config.current_limit_A = 40;
    config.speed_limit_rpm = 4000;
    config.stator_limit_C = 150;
    config.voltage_limit_V = 230;
    config.silence_us = 5000000;
    config.give_up_us = 20000000;
    return config;
  }

  std::unique_ptr<Transport> transport_;

 public:
  LinkHost link;
  std::int64_t credit_end = std::numeric_limits<std::int64_t>::max();  // no credit beyond
  std::map<std::int64_t, std::int32_t> answers;
  std::vector<imrig_block> blocks;
  imrig_status status = {};

 private:
  std::vector<std::uint8_t> buffer_;
};

struct Sampled {
  std::int64_t index;
  int segment, record, gates_on;
  SpaceVector i_A, v_V;
  std::int32_t encoder;
};

// All samples of the blocks, in physical units by the welcome's scales.
inline std::vector<Sampled> samples_of(const MinimalHost& host) {
  std::vector<Sampled> samples;
  const imrig_welcome& w = *host.link.welcome();
  const double a = static_cast<double>(w.current_A_per_count), v = static_cast<double>(w.voltage_V_per_count);
  for (const imrig_block& b : host.blocks) {
    for (int k = 0; k < b.n; ++k) {
      samples.push_back({b.first_index + k, b.segment, b.record, b.gates_on,
                         a * space_vector(b.i_a[k], b.i_b[k], b.i_c[k]),
                         v * space_vector(b.v_a[k], b.v_b[k], b.v_c[k]), b.encoder[k]});
    }
  }
  return samples;
}

}  // namespace imrig::test
