#include "rig/base/clock.h"

#include <sys/random.h>
#include <time.h>

#include "rig/base/error.h"

namespace imrig {

namespace {
std::int64_t read_us(clockid_t id) {
  timespec now = {};
  ::clock_gettime(id, &now);
  return std::int64_t{now.tv_sec} * 1000000 + now.tv_nsec / 1000;
}
}  // namespace

std::int64_t monotonic_us() { return read_us(CLOCK_MONOTONIC); }
std::int64_t wall_us() { return read_us(CLOCK_REALTIME); }

std::int64_t random_id() {
  std::int64_t id = 0;
  while (id == 0) {
    if (::getrandom(&id, sizeof id, 0) != static_cast<ssize_t>(sizeof id)) throw Error("getrandom", "failed");
    id &= 0x7fffffffffffffffll;
  }
  return id;
}

}  // namespace imrig
