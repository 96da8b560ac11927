#include "rig/bus/multicast.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "rig/base/error.h"
#include "rig/base/url.h"

namespace imrig {

namespace {

constexpr char kRight[] = "udpm://239.255.76.77:7790?ttl=0 would be right";
constexpr long kReceiveBuffer = 4194304;

sockaddr_in address_of(const Url& url) {
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(url.port));
  const bool parsed = ::inet_pton(AF_INET, url.host.c_str(), &address.sin_addr) == 1;
  if (!parsed || !IN_MULTICAST(ntohl(address.sin_addr.s_addr))) {
    throw Error("bus " + url.text, "the group must be an address in 224.0.0.0 to 239.255.255.255", kRight);
  }
  if (url.port == 0) throw Error("bus " + url.text, "the port must be 1 to 65535", kRight);
  return address;
}

// Connecting a datagram socket sends nothing but asks the routing table.
void check_route(const Url& url, const sockaddr_in& address) {
  const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) throw Error("bus " + url.text, std::string("no socket: ") + std::strerror(errno));
  const int result = ::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address);
  const int reason = errno;
  ::close(fd);
  if (result == 0) return;
  throw Error("bus " + url.text, std::string("no multicast route (") + std::strerror(reason) + ")",
              "add one: ip route add 224.0.0.0/4 dev lo");
}

}  // namespace

std::string checked_lcm_url(const std::string& text) {
  const Url url = parse_url(text);
  if (url.scheme != "udpm" || url.host.empty()) throw Error("bus " + text, "is no LCM multicast URL", kRight);
  for (const auto& [key, value] : url.options) {
    if (key != "ttl" && key != "recv_buf_size")
      throw Error("bus " + text, "option " + key + " is unknown", "ttl and recv_buf_size are known");
  }
  const long ttl = url.option_or("ttl", 0, 0, 255);
  const long buffer = url.option_or("recv_buf_size", kReceiveBuffer, 4096, 1 << 30);
  check_route(url, address_of(url));
  return "udpm://" + url.host + ":" + std::to_string(url.port) + "?ttl=" + std::to_string(ttl) +
         "&recv_buf_size=" + std::to_string(buffer);
}

}  // namespace imrig
