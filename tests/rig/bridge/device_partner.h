#pragma once
// The device core that firmware runs, on a UDP socket of its own and in a thread of its own: what
// imrig-bridge talks to in these tests.

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "rig/link/device/imrig_device.h"
#include "rig/link/transport.h"

namespace imrig {

class DevicePartner {
 public:
  // at_max_pace: its clock runs as fast as the host's credits allow, else in real time.
  explicit DevicePartner(bool at_max_pace = false);
  ~DevicePartner();
  DevicePartner(const DevicePartner&) = delete;
  DevicePartner& operator=(const DevicePartner&) = delete;

  std::string url() const { return transport_->url(); }
  std::int64_t sent_us(std::int64_t first_index);  // monotonic, of the block that begins there; 0: none

  std::atomic<bool> gates_on = false;
  std::atomic<std::int64_t> gates_off_us = 0;  // monotonic: when they opened last
  std::atomic<std::int64_t> next_index = 0;
  std::atomic<int> trip = 0;
  std::atomic<bool> mute = false;  // hears and says nothing
  std::atomic<float> stator_C = 25.0f;

 private:
  void live();
  void hear(std::int64_t now_ms);
  void say();
  void take_samples(std::int64_t now_us);

  bool at_max_pace_;
  std::unique_ptr<Transport> transport_;
  imrig_device device_;
  std::int64_t started_us_ = 0;
  std::mutex mutex_;
  std::map<std::int64_t, std::int64_t> sent_;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

}  // namespace imrig
