#pragma once
// A port that nobody holds, for a test that must name it before its process binds it.

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <stdexcept>

namespace imrig::test {

// Below the range from which the kernel hands ports to any socket that asks for none, so that no other program's
// socket takes it between the look and the bind; and from a block of this process's own, so that no other test does.
// type: SOCK_DGRAM or SOCK_STREAM. Throws std::runtime_error when the block is used up.
inline int free_port(int type) {
  constexpr int kFirst = 18000;
  constexpr int kBlock = 56;
  constexpr int kBlocks = 250;  // to 31999; the kernel's range begins at 32768
  static int next = 0;
  const int first = kFirst + static_cast<int>(::getpid() % kBlocks) * kBlock;
  for (int tries = 0; tries < kBlock; ++tries) {
    const int port = first + next++ % kBlock;
    const int fd = ::socket(AF_INET, type | SOCK_CLOEXEC, 0);
    sockaddr_in address = {};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    const bool bound = fd >= 0 && ::bind(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
    if (fd >= 0) ::close(fd);
    if (bound) return port;
  }
  throw std::runtime_error("no free port in this test's block");
}

}  // namespace imrig::test
