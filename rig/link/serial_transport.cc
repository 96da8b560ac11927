#include "rig/link/serial_transport.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/file.h>
#include <termios.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <map>
#include <thread>
#include <vector>

#include "rig/base/error.h"
#include "rig/base/url.h"
#include "rig/link/descriptor.h"

namespace imrig {

namespace {

constexpr std::size_t kQueueBytes = 262144;  // more than the 32 blocks that a host grants at most

[[noreturn]] void fail(const Url& url, const std::string& what, const std::string& right) {
  throw Error("link '" + url.text + "'", what, right);
}

speed_t speed_of(const Url& url) {
  static const std::map<long, speed_t> kSpeeds = {
      {9600, B9600},       {19200, B19200},     {38400, B38400},     {57600, B57600},     {115200, B115200},
      {230400, B230400},   {460800, B460800},   {500000, B500000},   {576000, B576000},   {921600, B921600},
      {1000000, B1000000}, {1152000, B1152000}, {1500000, B1500000}, {2000000, B2000000}, {2500000, B2500000},
      {3000000, B3000000}, {3500000, B3500000}, {4000000, B4000000}};
  const auto found = kSpeeds.find(url.option_or("baud", 115200, 1, 100'000'000));
  if (found == kSpeeds.end()) {
    fail(url, "the system knows no such baud rate",
         "921600, 1000000, 2000000, 3000000 and 4000000 are usual");
  }
  return found->second;
}

Descriptor open_device(const Url& url) {
  Descriptor device(::open(url.path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (device.get() < 0) {
    fail(url, std::string("cannot be opened: ") + std::strerror(errno),
         errno == EACCES ? "your user may have to join the group dialout" : "is the adapter plugged in?");
  }
  if (::isatty(device.get()) == 0)
    fail(url, "is no serial line", "wanted is a device file like /dev/ttyUSB0");
  if (::flock(device.get(), LOCK_EX | LOCK_NB) != 0) fail(url, "is in use", "stop the other program first");
  return device;
}

void make_raw(const Url& url, int fd, speed_t speed) {
  termios line = {};
  if (::tcgetattr(fd, &line) != 0)
    fail(url, std::string("has no line settings: ") + std::strerror(errno), "");
  ::cfmakeraw(&line);
  line.c_cflag |= CLOCAL | CREAD;
  line.c_cflag &= ~static_cast<tcflag_t>(CSTOPB | CRTSCTS);
  line.c_cc[VMIN] = 0;
  line.c_cc[VTIME] = 0;
  ::cfsetispeed(&line, speed);
  ::cfsetospeed(&line, speed);
  const bool set = ::tcsetattr(fd, TCSANOW, &line) == 0 && ::tcgetattr(fd, &line) == 0;
  if (!set || ::cfgetospeed(&line) != speed)
    fail(url, "cannot be set to that baud rate", "choose one the adapter has");
}

class SerialTransport : public Transport {
 public:
  explicit SerialTransport(const Url& url) : url_(url.text) {
    const speed_t speed = speed_of(url);
    device_ = open_device(url);
    make_raw(url, device_.get(), speed);
  }

  std::size_t read(std::span<std::uint8_t> buffer) override {
    flush();
    const ssize_t n = ::read(device_.get(), buffer.data(), buffer.size());
    return n > 0 ? static_cast<std::size_t>(n) : 0;
  }

  bool write(std::span<const std::uint8_t> frames) override {
    flush();
    if (queue_.size() + frames.size() > kQueueBytes) return false;
    queue_.insert(queue_.end(), frames.begin(), frames.end());
    flush();
    return true;
  }

  bool wait(int timeout_ms) override {
    using std::chrono::steady_clock;
    const auto until = steady_clock::now() + std::chrono::milliseconds(timeout_ms);
    for (;;) {
      pollfd item = {device_.get(), static_cast<short>(queue_.empty() ? POLLIN : POLLIN | POLLOUT), 0};
      const auto left =
          std::chrono::duration_cast<std::chrono::milliseconds>(until - steady_clock::now()).count();
      if (::poll(&item, 1, static_cast<int>(std::max<long>(left, 0))) <= 0) return false;
      if ((item.revents & POLLOUT) != 0) flush();
      if ((item.revents & POLLIN) != 0) return true;
      if ((item.revents & (POLLHUP | POLLERR)) != 0) {
        // The other side is gone, which poll would tell again at once; it may come back (a
        // pseudo-terminal's).
        std::this_thread::sleep_for(std::chrono::milliseconds(std::clamp<long>(left, 0, 10)));
        if (left <= 0) return false;
      }
    }
  }

  int fd() const override { return device_.get(); }
  std::string url() const override { return url_; }

 private:
  void flush() {
    if (queue_.empty()) return;
    const ssize_t n = ::write(device_.get(), queue_.data(), queue_.size());
    if (n > 0) queue_.erase(queue_.begin(), queue_.begin() + n);
  }

  std::string url_;
  Descriptor device_;
  std::vector<std::uint8_t> queue_;
};

}  // namespace

std::unique_ptr<Transport> open_serial(const Url& url) { return std::make_unique<SerialTransport>(url); }

}  // namespace imrig
