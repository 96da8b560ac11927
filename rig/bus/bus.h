#pragma once
// The message bus behind one small interface: LCM over UDP multicast in the processes, a queue in memory for
// tests of cores. One thread owns a Bus: publish, subscribe and wait are called from it alone.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "rig/base/rig_config.h"
#include "rig/bus/bytes.h"
#include "rig/bus/guarded_decode.h"

namespace imrig {

class Bus {
 public:
  using RawHandler = std::function<void(std::string_view channel, Bytes data)>;

  virtual ~Bus() = default;
  // name is without the prefix ("SAMPLES"); the bus adds "PREFIX_".
  virtual void publish_raw(const std::string& name, Bytes data) = 0;
  // Handler for one name, or for every message of the bus (any prefix) with "*"; the channel is handed over
  // in full.
  virtual void subscribe_raw(const std::string& name, RawHandler handler) = 0;
  // Waits up to timeout_ms for messages and handles all that are there. Returns how many were handled.
  virtual int wait(int timeout_ms) = 0;
  // For poll(2) with POLLIN beside other descriptors: readable when wait(0) would handle something. -1 where
  // there is none (memory).
  virtual int fd() const { return -1; }
};

// Throws Error when the URL is bad or there is no multicast route (and says how to add one).
std::unique_ptr<Bus> open_lcm_bus(const BusConfig& config);

// A bus inside one process: all MemoryBus objects made from one hub see each other's messages, in order,
// without loss.
class MemoryHub;
std::shared_ptr<MemoryHub> make_memory_hub();
std::unique_ptr<Bus> open_memory_bus(std::shared_ptr<MemoryHub> hub, const std::string& prefix = "IMRIG");

template <class Message>
void publish(Bus& bus, const std::string& name, const Message& message) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  bus.publish_raw(name, bytes);
}

// Messages that are not of the type, or whose lengths do not fit their datagram, are dropped and counted in
// *bad (if given).
template <class Message>
void subscribe(Bus& bus, const std::string& name, std::function<void(const Message&)> handler,
               std::int64_t* bad = nullptr) {
  bus.subscribe_raw(name, [handler = std::move(handler), bad](std::string_view, Bytes data) {
    if (const std::optional<Message> message = guarded_decode<Message>(data)) {
      handler(*message);
    } else if (bad != nullptr) {
      ++*bad;
    }
  });
}

}  // namespace imrig
