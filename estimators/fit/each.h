#pragma once
// Work over many records by a few threads: whoever is free takes the next. What work(k) writes belongs to k
// alone, so the result does not depend on the number of threads.

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <thread>
#include <vector>

namespace imrig::est {

inline constexpr int kMostThreads = 64;

// work must not throw.
template <class Work>
void each(std::size_t n, int threads, const Work& work) {
  std::atomic<std::size_t> next{0};
  const auto run = [&] {
    for (std::size_t k = next++; k < n; k = next++) work(k);
  };
  std::vector<std::jthread> helpers;
  const auto wanted =
      static_cast<int>(std::min(n, static_cast<std::size_t>(std::clamp(threads, 1, kMostThreads))));
  for (int t = 1; t < wanted; ++t) helpers.emplace_back(run);
  run();
}

}  // namespace imrig::est
