#pragma once
// Two pseudo-terminals joined back to back, as a serial cable joins two ports. Bytes can be changed on their
// way.

#include <fcntl.h>
#include <poll.h>
#include <pty.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <functional>
#include <stdexcept>
#include <string>
#include <thread>

namespace imrig::test {

class PtyPair {
 public:
  PtyPair() {
    for (End& end : ends_) open_end(end);
    thread_ = std::thread([this] { pump(); });
  }
  ~PtyPair() {
    stop_ = true;
    thread_.join();
    for (const End& end : ends_) {
      ::close(end.master);
      ::close(end.slave);
    }
  }
  PtyPair(const PtyPair&) = delete;
  PtyPair& operator=(const PtyPair&) = delete;

  std::string a() const { return ends_[0].name; }
  std::string b() const { return ends_[1].name; }
  // What arrives at b's side without having been sent by a.
  void inject_to_b(const std::string& bytes) { put(ends_[1].master, bytes.data(), bytes.size()); }
  std::atomic<bool> cut = false;  // nothing passes

 private:
  struct End {
    int master = -1, slave = -1;
    std::string name;
  };

  static void open_end(End& end) {
    termios raw{};
    ::cfmakeraw(&raw);
    char name[128];
    if (::openpty(&end.master, &end.slave, name, &raw, nullptr) != 0)
      throw std::runtime_error("openpty failed");
    end.name = name;
    ::fcntl(end.master, F_SETFL, O_NONBLOCK);
  }

  static void put(int fd, const char* bytes, std::size_t n) {
    while (n > 0) {
      const ssize_t done = ::write(fd, bytes, n);
      if (done <= 0) return;
      bytes += done;
      n -= static_cast<std::size_t>(done);
    }
  }

  void pump() {
    std::array<char, 4096> bytes;
    while (!stop_) {
      std::array<pollfd, 2> fds = {{{ends_[0].master, POLLIN, 0}, {ends_[1].master, POLLIN, 0}}};
      ::poll(fds.data(), fds.size(), 20);
      for (std::size_t k = 0; k < 2; ++k) {
        if ((fds[k].revents & POLLIN) == 0) continue;
        const ssize_t n = ::read(ends_[k].master, bytes.data(), bytes.size());
        if (n > 0 && !cut) put(ends_[1 - k].master, bytes.data(), static_cast<std::size_t>(n));
      }
    }
  }

  std::array<End, 2> ends_;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

}  // namespace imrig::test
