#pragma once
// The DSP link over UDP: one datagram carries whole frames, one or several.

#include <memory>

#include "rig/link/transport.h"

namespace imrig {

struct Url;

std::unique_ptr<Transport> open_udp(const Url& url, bool listens);

}  // namespace imrig
