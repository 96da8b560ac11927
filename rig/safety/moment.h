#pragma once
// Host time, handed to cores by mains. Durations (leases, silence) are measured on the steady clock, which
// nobody can set; the wall clock only dates messages, so that an old one is known for what it is.

#include <cstdint>

namespace imrig {

struct Moment {
  std::int64_t steady_us = 0;  // since some fixed moment, never backwards
  std::int64_t wall_us = 0;    // since 1970; may jump
};

// A message dated further ahead than this was dated by a clock we cannot trust.
inline constexpr std::int64_t kFutureTolerance_us = 1'000'000;

// Is a message that was dated issued_wall_us still worth acting on? Written so that no number off the wire
// can overflow.
constexpr bool in_time(std::int64_t issued_wall_us, std::int64_t ttl_ms, Moment now) {
  if (issued_wall_us < 0 || now.wall_us < 0 || ttl_ms < 0) return false;
  const std::int64_t age_us = now.wall_us - issued_wall_us;
  return age_us >= -kFutureTolerance_us && age_us / 1000 < ttl_ms;
}

}  // namespace imrig
