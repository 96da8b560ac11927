// Modbus TCP for several clients in one thread. Frames are put together per client without blocking, so a
// client that sends half a frame, none at all, or does not read its replies costs the others nothing. A frame
// that breaks the framing closes its own connection.

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <exception>
#include <thread>
#include <utility>
#include <vector>

#include "plant/modbus_face.h"
#include "rig/base/error.h"

namespace imrig::plant {

namespace {

constexpr std::size_t kMaxClients = 16;
constexpr std::size_t kPrefix = 6;       // transaction, protocol, length
constexpr std::size_t kMaxLength = 254;  // unit and protocol data unit

class Client {
 public:
  explicit Client(int fd) : fd_(fd) {}
  Client(Client&& other) noexcept
      : fd_(std::exchange(other.fd_, -1)), bytes_(std::move(other.bytes_)), turn(other.turn) {}
  Client& operator=(Client&& other) noexcept {
    std::swap(fd_, other.fd_);
    std::swap(bytes_, other.bytes_);
    std::swap(turn, other.turn);
    return *this;
  }
  ~Client() {
    if (fd_ >= 0) close(fd_);
  }
  int fd() const { return fd_; }

  // Takes what is there and answers every whole frame. False when the connection is to be closed.
  bool serve(modbus_t* context, ModbusFace& face) {
    std::uint8_t chunk[1024];
    const ssize_t n = recv(fd_, chunk, sizeof chunk, 0);
    if (n < 0) return errno == EAGAIN || errno == EINTR;
    if (n == 0) return false;
    bytes_.insert(bytes_.end(), chunk, chunk + n);
    return answer_frames(context, face);
  }

 private:
  bool answer_frames(modbus_t* context, ModbusFace& face) {
    std::size_t at = 0;
    while (bytes_.size() - at > kPrefix) {
      const std::uint8_t* frame = bytes_.data() + at;
      const std::size_t length = static_cast<std::size_t>(frame[4]) << 8 | frame[5];
      if (frame[2] != 0 || frame[3] != 0 || length < 2 || length > kMaxLength) return false;
      if (bytes_.size() - at < kPrefix + length) break;
      modbus_set_socket(context, fd_);
      if (!face.answer(context, {frame, kPrefix + length}, 0)) return false;
      at += kPrefix + length;
    }
    bytes_.erase(bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(at));
    return true;
  }

  int fd_;
  std::vector<std::uint8_t> bytes_;  // at most one frame and a chunk

 public:
  std::uint64_t turn = 0;  // of the last byte that came
};

class TcpServer : public ModbusWire {
 public:
  TcpServer(const std::string& host, int port, ModbusFace& face) : face_(face), host_(host) {
    in_addr address{};
    if (inet_pton(AF_INET, host.c_str(), &address) != 1) {
      throw Error("Modbus server", fmt::format("'{}' is no IPv4 address", host), "for instance 127.0.0.1");
    }
    context_.reset(modbus_new_tcp(host.c_str(), port));
    if (!context_) fail(port);
    listener_ = modbus_tcp_listen(context_.get(), 8);
    if (listener_ < 0) fail(port);
    fcntl(listener_, F_SETFL, fcntl(listener_, F_GETFL) | O_NONBLOCK);
    sockaddr_in bound{};
    socklen_t size = sizeof bound;
    getsockname(listener_, reinterpret_cast<sockaddr*>(&bound), &size);
    port_ = ntohs(bound.sin_port);
    stop_ = eventfd(0, EFD_CLOEXEC);
    thread_ = std::thread([this] { run(); });
  }

  ~TcpServer() override {
    const std::uint64_t one = 1;
    if (write(stop_, &one, sizeof one) != sizeof one) std::terminate();
    thread_.join();
    close(stop_);
    close(listener_);
    modbus_set_socket(context_.get(), -1);  // that of the last client, closed already
  }

  std::string bound_url() const override { return fmt::format("tcp://{}:{}", host_, port_); }

 private:
  [[noreturn]] static void fail(int port) {
    throw Error("Modbus server", fmt::format("port {}: {}", port, std::strerror(errno)),
                "a free port, or 0 for any");
  }

  void run() {
    std::vector<pollfd> fds;
    while (true) {
      fds.assign({{stop_, POLLIN, 0}, {listener_, POLLIN, 0}});
      for (const Client& client : clients_) fds.push_back({client.fd(), POLLIN, 0});
      if (poll(fds.data(), fds.size(), -1) < 0 && errno != EINTR) return;
      if (fds[0].revents != 0) return;
      serve_clients(fds);
      if (fds[1].revents != 0) take_client();
    }
  }

  void serve_clients(const std::vector<pollfd>& fds) {
    ++turn_;
    for (std::size_t i = clients_.size(); i-- > 0;) {
      if (fds[i + 2].revents == 0) continue;
      clients_[i].turn = turn_;
      if (!clients_[i].serve(context_.get(), face_))
        clients_.erase(clients_.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }

  // A full house shows out whoever has been silent longest: a connection that is half open would hold its
  // place forever.
  void take_client() {
    const int fd = accept4(listener_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (fd < 0) return;
    if (clients_.size() >= kMaxClients) {
      clients_.erase(std::ranges::min_element(clients_, {}, &Client::turn));
    }
    clients_.emplace_back(fd).turn = turn_;
  }

  ModbusFace& face_;
  std::string host_;
  ModbusContext context_;
  int listener_ = -1;
  int stop_ = -1;
  int port_ = 0;
  std::uint64_t turn_ = 0;
  std::vector<Client> clients_;
  std::thread thread_;
};

}  // namespace

std::unique_ptr<ModbusWire> serve_tcp(const std::string& host, int port, ModbusFace& face) {
  return std::make_unique<TcpServer>(host, port, face);
}

}  // namespace imrig::plant
