#pragma once
// Counts what a program takes from the heap, by replacing the global operator new: include it in one file of a test
// program of its own.

#include <atomic>
#include <cstdlib>
#include <new>

namespace imrig::test {
inline std::atomic<long> allocations = 0;
}

// Not inlined: the compiler would then see malloc here and delete there.
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++imrig::test::allocations;
  if (void* memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
