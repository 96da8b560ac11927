#pragma once

#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <string>
#include <thread>

#include "rig/base/error.h"

namespace imrig::test {

// Two pseudo-terminals whose masters are wired to each other, as socat does: opening the two names is a
// serial line.
class SerialLine {
 public:
  SerialLine() {
    for (int k = 0; k < 2; ++k) {
      const auto side = static_cast<std::size_t>(k);
      masters_[side] = ::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK);
      if (masters_[side] < 0 || ::grantpt(masters_[side]) != 0 || ::unlockpt(masters_[side]) != 0)
        throw Error("no pty");
      std::array<char, 100> name;
      if (::ptsname_r(masters_[side], name.data(), name.size()) != 0) throw Error("no pty name");
      names[side] = name.data();
      keepers_[side] =
          ::open(name.data(), O_RDWR | O_NOCTTY);  // so that the master sees no hang-up between users
    }
    pump_ = std::thread([this] { pump(); });
  }
  ~SerialLine() {
    stop_ = true;
    pump_.join();
    for (const int fd : {masters_[0], masters_[1], keepers_[0], keepers_[1]}) ::close(fd);
  }
  std::array<std::string, 2> names;

 private:
  void pump() {
    std::array<std::uint8_t, 4096> buffer;
    while (!stop_) {
      pollfd items[2] = {{masters_[0], POLLIN, 0}, {masters_[1], POLLIN, 0}};
      ::poll(items, 2, 20);
      for (std::size_t k = 0; k < 2; ++k) {
        const ssize_t n = ::read(masters_[k], buffer.data(), buffer.size());
        for (ssize_t sent = 0; sent < n && !stop_;) {
          const ssize_t more =
              ::write(masters_[1 - k], buffer.data() + sent, static_cast<std::size_t>(n - sent));
          if (more > 0) sent += more;
          if (more < 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
      }
    }
  }
  std::array<int, 2> masters_ = {-1, -1}, keepers_ = {-1, -1};
  std::atomic<bool> stop_ = false;
  std::thread pump_;
};

}  // namespace imrig::test
