#pragma once
// Time of one core: the program is pinned, and the processor's time of the thread counts, so that other work on
// the machine disturbs the caches but not the clock.

#include <sched.h>
#include <time.h>

#include <algorithm>
#include <vector>

namespace imrig::bench {

// To the last core this process may use; false where the system forbids it.
inline bool pin_to_one_core() {
  cpu_set_t allowed;
  if (::sched_getaffinity(0, sizeof allowed, &allowed) != 0) return false;
  for (std::size_t core = CPU_SETSIZE; core-- > 0;) {
    if (!CPU_ISSET(core, &allowed)) continue;
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(core, &one);
    return ::sched_setaffinity(0, sizeof one, &one) == 0;
  }
  return false;
}

inline double core_s() {
  timespec t = {};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

struct Spread {
  double median, least, most;
};

inline Spread spread(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return {values[values.size() / 2], values.front(), values.back()};
}

// Core seconds of work(), repeated.
template <class Work>
std::vector<double> timed(int times, const Work& work) {
  std::vector<double> seconds;
  for (int k = 0; k < times; ++k) {
    const double start = core_s();
    work();
    seconds.push_back(core_s() - start);
  }
  return seconds;
}

}  // namespace imrig::bench
