#pragma once
// The DSP link over a serial line or pseudo-terminal: raw bytes, 8 data bits, no parity, 1 stop bit, no flow
// control.

#include <memory>

#include "rig/link/transport.h"

namespace imrig {

struct Url;

std::unique_ptr<Transport> open_serial(const Url& url);

}  // namespace imrig
