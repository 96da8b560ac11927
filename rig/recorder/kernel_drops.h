#pragma once
// Datagrams the kernel dropped before anybody could read them: LCM has no counter of its own.

#include <cstdint>

namespace imrig {

// Sum over this process's own UDP sockets, from /proc/net/udp. 0 where that cannot be read.
std::int64_t kernel_drops();

}  // namespace imrig
