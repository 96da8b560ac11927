#pragma once
// Real wires and files for the tests of this room: a bus on a port of its own, raw LCM datagrams, whole event
// logs.

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <fstream>
#include <functional>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "rig/base/error.h"
#include "rig/base/rig_config.h"
#include "rig/bus/bus.h"
#include "rig/bus/event_log.h"
#include "tests/e2e/command.h"

namespace imrig::test {

inline constexpr char kGroup[] = "239.255.76.77";

inline std::string url_of(int port) {
  return std::string("udpm://") + kGroup + ":" + std::to_string(port) + "?ttl=0&recv_buf_size=4194304";
}

inline BusConfig bus_config(int port, const std::string& prefix = "IMRIG") { return {url_of(port), prefix}; }

// Handles messages until the condition holds; false after the timeout.
inline bool wait_until(Bus& bus, const std::function<bool()>& condition, int timeout_s = 60) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(timeout_s);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    bus.wait(20);
  }
  return true;
}

inline bool wait_until(const std::function<bool()>& condition, int timeout_s = 60) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(timeout_s);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return true;
}

// A datagram as LCM sends it, made by hand: "LC02", sequence, channel, NUL, data. Or any bytes at all.
class RawSender {
 public:
  explicit RawSender(int port) : fd_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    address_.sin_family = AF_INET;
    address_.sin_port = htons(static_cast<std::uint16_t>(port));
    ::inet_pton(AF_INET, kGroup, &address_.sin_addr);
  }
  ~RawSender() { ::close(fd_); }
  RawSender(const RawSender&) = delete;
  RawSender& operator=(const RawSender&) = delete;

  void message(const std::string& channel, Bytes data) {
    std::vector<std::uint8_t> packet = {'L', 'C', '0', '2', 0, 0, 0, ++sequence_};
    packet.insert(packet.end(), channel.begin(), channel.end());
    packet.push_back(0);
    packet.insert(packet.end(), data.begin(), data.end());
    bytes(packet);
  }
  void bytes(Bytes packet) {
    ::sendto(fd_, packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&address_),
             sizeof address_);
  }

 private:
  int fd_;
  sockaddr_in address_ = {};
  std::uint8_t sequence_ = 0;
};

// Waits until nothing lies in the kernel's buffers of the sockets on this port. They are small and the
// machine may be busy: a test of what comes behind them must not overrun them.
inline bool let_kernel_drain(int port) {
  char wanted[8];
  std::snprintf(wanted, sizeof wanted, ":%04X", static_cast<unsigned>(port));
  return wait_until([&] {
    std::ifstream table("/proc/net/udp");
    std::string line;
    while (std::getline(table, line)) {
      std::istringstream words(line);
      std::string slot, local, remote, state, queues;
      words >> slot >> local >> remote >> state >> queues;
      if (local.ends_with(wanted) && !queues.ends_with(":00000000")) return false;
    }
    return true;
  });
}

// Whole events of a log that may just have been begun: none when there is none yet.
inline std::vector<LogEvent> all_events(const std::string& path) {
  std::vector<LogEvent> events;
  try {
    EventLogReader log(path);
    while (auto event = log.next()) events.push_back(std::move(*event));
  } catch (const Error&) {
    return {};
  }
  return events;
}

}  // namespace imrig::test
