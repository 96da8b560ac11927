#include "rig/link/udp_transport.h"

#include <arpa/inet.h>
#include <netdb.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include <cerrno>
#include <cstring>

#include "rig/base/error.h"
#include "rig/base/url.h"
#include "rig/link/descriptor.h"

namespace imrig {

namespace {

constexpr int kBufferBytes =
    4 << 20;  // about 1,000 blocks: the other side may sleep for seconds in real time

sockaddr* generic(sockaddr_in* address) { return reinterpret_cast<sockaddr*>(address); }
const sockaddr* generic(const sockaddr_in* address) { return reinterpret_cast<const sockaddr*>(address); }

[[noreturn]] void fail(const Url& url, const std::string& what, const std::string& right) {
  throw Error("link '" + url.text + "'", what, right);
}

sockaddr_in resolve(const Url& url) {
  addrinfo hints = {};
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_DGRAM;
  addrinfo* found = nullptr;
  const int error = ::getaddrinfo(url.host.c_str(), nullptr, &hints, &found);
  if (error != 0 || found == nullptr) {
    fail(url, "host '" + url.host + "' is unknown (" + ::gai_strerror(error) + ")",
         "127.0.0.1 is this machine");
  }
  sockaddr_in address = {};
  std::memcpy(&address, found->ai_addr, sizeof address);
  ::freeaddrinfo(found);
  address.sin_port = htons(static_cast<std::uint16_t>(url.port));
  return address;
}

std::string text_of(const sockaddr_in& address) {
  char text[INET_ADDRSTRLEN] = {};
  ::inet_ntop(AF_INET, &address.sin_addr, text, sizeof text);
  return std::string(text) + ":" + std::to_string(ntohs(address.sin_port));
}

bool same(const sockaddr_in& a, const sockaddr_in& b) {
  return a.sin_addr.s_addr == b.sin_addr.s_addr && a.sin_port == b.sin_port;
}

class UdpTransport : public Transport {
 public:
  UdpTransport(const Url& url, bool listens) : listens_(listens), scheme_(url.scheme) {
    const sockaddr_in address = resolve(url);
    socket_ = Descriptor(::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
    if (socket_.get() < 0) fail(url, std::string("no socket: ") + std::strerror(errno), "");
    // Best effort: the system caps them at net.core.rmem_max and wmem_max, unless it is root who asks.
    for (const int option : {SO_RCVBUF, SO_SNDBUF, SO_RCVBUFFORCE, SO_SNDBUFFORCE}) {
      ::setsockopt(socket_.get(), SOL_SOCKET, option, &kBufferBytes, sizeof kBufferBytes);
    }
    if (listens) {
      bind_to(url, address);
    } else if (::connect(socket_.get(), generic(&address), sizeof address) != 0) {
      fail(url, std::string("cannot be reached: ") + std::strerror(errno), "is there a route to that host?");
    } else {
      address_ = address;
    }
  }

  std::size_t read(std::span<std::uint8_t> buffer) override {
    sender_ = {};
    socklen_t length = sizeof sender_;
    // A refused port is told once as an error of the next call: nobody is there (yet), which is no fault of
    // ours.
    for (int attempt = 0; attempt < 2; ++attempt) {
      const ssize_t n =
          ::recvfrom(socket_.get(), buffer.data(), buffer.size(), 0, generic(&sender_), &length);
      if (n > 0) return static_cast<std::size_t>(n);
      if (n < 0 && errno != ECONNREFUSED && errno != EINTR) return 0;
    }
    return 0;
  }

  bool write(std::span<const std::uint8_t> frames) override {
    if (listens_ && !has_peer_) return false;
    for (int attempt = 0; attempt < 2; ++attempt) {
      const ssize_t n =
          listens_ ? ::sendto(socket_.get(), frames.data(), frames.size(), 0, generic(&peer_), sizeof peer_)
                   : ::send(socket_.get(), frames.data(), frames.size(), 0);
      if (n == static_cast<ssize_t>(frames.size())) return true;
      if (errno != ECONNREFUSED && errno != EINTR) return false;
    }
    return false;
  }

  bool wait(int timeout_ms) override {
    pollfd item = {socket_.get(), POLLIN, 0};
    return ::poll(&item, 1, timeout_ms) > 0;
  }

  int fd() const override { return socket_.get(); }
  std::string url() const override { return (listens_ ? "udp://" : scheme_ + "://") + text_of(address_); }
  bool from_stranger() const override { return listens_ && (!has_peer_ || !same(sender_, peer_)); }
  void accept_sender() override {
    if (!listens_) return;
    peer_ = sender_;
    has_peer_ = true;
  }

 private:
  void bind_to(const Url& url, const sockaddr_in& address) {
    if (::bind(socket_.get(), generic(&address), sizeof address) != 0) {
      if (errno == EADDRINUSE)
        fail(url, "the port is in use", "stop the other program, or choose another port (0: any free one)");
      fail(url, std::string("cannot listen there: ") + std::strerror(errno),
           "the host must be an address of this machine");
    }
    socklen_t length = sizeof address_;
    ::getsockname(socket_.get(), generic(&address_), &length);
  }

  bool listens_;
  std::string scheme_;
  Descriptor socket_;
  sockaddr_in address_ = {};
  sockaddr_in sender_ = {};
  sockaddr_in peer_ = {};
  bool has_peer_ = false;
};

}  // namespace

std::unique_ptr<Transport> open_udp(const Url& url, bool listens) {
  return std::make_unique<UdpTransport>(url, listens);
}

}  // namespace imrig
