#pragma once
// The firmware's wire: feeds it what comes in and sends what it has to say. Over UDP anybody can send to the
// port; only who says a hello that the device takes is listened to and answered.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "plant/firmware.h"
#include "rig/link/transport.h"

namespace imrig::plant {

class LinkPort {
 public:
  // "udp://HOST:PORT" (listens there; 0: any free port) or "serial:///dev/...?baud=N". Throws Error.
  explicit LinkPort(const std::string& url);

  void receive(Firmware& firmware, std::int64_t now_ms);  // all that is there
  void send(Firmware& firmware);
  bool wait(int timeout_ms);
  std::string url() const;
  std::int64_t unsent_frames() const { return unsent_; }

 private:
  void hear_stranger(Firmware& firmware, std::span<const std::uint8_t> datagram, std::int64_t now_ms);

  std::unique_ptr<Transport> transport_;
  std::vector<std::uint8_t> in_;
  std::vector<std::uint8_t> out_;
  std::int64_t unsent_ = 0;
};

}  // namespace imrig::plant
