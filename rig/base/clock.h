#pragma once
// Clocks, read by mains only; cores get time handed in.

#include <cstdint>

namespace imrig {

std::int64_t monotonic_us();  // since some fixed moment
std::int64_t wall_us();       // since 1970
std::int64_t random_id();     // random, positive, never 0: instances, challenges, epochs

}  // namespace imrig
