// Its own program: it replaces the global operator new.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "tests/estimators/online/synthetic.h"

namespace {
std::atomic<long> g_allocations = 0;
}  // namespace

// Not inlined: the compiler would then see malloc here and delete there.
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++g_allocations;
  if (void* memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace imrig::est {
namespace {

TEST(OperatingPointMemory, NothingIsAllocatedAfterTheFirstBlock) {
  Signal s;
  const std::size_t n = 33000;
  const Samples x = make_samples(s, n);
  int windows = 0;
  OperatingPointEstimator estimator({}, [&](const OperatingPoint&) { ++windows; });
  estimator.feed(block_of(s, x, 0, 1, 0));
  const long before = g_allocations;
  for (std::size_t at = 1; at + 128 <= n; at += 128) {
    estimator.feed(block_of(s, x, at, 128, static_cast<std::int64_t>(at)));
  }
  SampleBlock off = block_of(s, x, 0, 30000, static_cast<std::int64_t>(n) + 1000);
  off.gates_on = false;
  estimator.feed(off);
  EXPECT_EQ(g_allocations, before);
  EXPECT_GE(windows, 15);
  EXPECT_GT(before, 0);
}

}  // namespace
}  // namespace imrig::est
