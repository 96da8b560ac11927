#pragma once
// A block of the DSP link as the bus message SAMPLES, with the scales of the device's welcome.

#include <imrig_msg/samples_t.hpp>

#include "rig/link/device/messages.h"

namespace imrig {

// block.n is 1..256, as the link's decoder guarantees.
imrig_msg::samples_t samples_of_block(const imrig_block& block, const imrig_welcome& welcome);

}  // namespace imrig
