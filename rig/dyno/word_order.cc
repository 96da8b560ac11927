#include "rig/dyno/word_order.h"

#include <utility>

namespace imrig {

namespace {

std::uint16_t swapped(std::uint16_t word) { return static_cast<std::uint16_t>((word << 8) | (word >> 8)); }

// Each order is its own inverse.
WordPair reordered(WordPair words, WordOrder order) {
  if (order == WordOrder::kCDAB || order == WordOrder::kDCBA) std::swap(words[0], words[1]);
  if (order == WordOrder::kBADC || order == WordOrder::kDCBA) words = {swapped(words[0]), swapped(words[1])};
  return words;
}

}  // namespace

WordPair words_of(std::uint32_t value, WordOrder order) {
  return reordered({static_cast<std::uint16_t>(value >> 16), static_cast<std::uint16_t>(value & 0xFFFF)},
                   order);
}

std::uint32_t value_of(WordPair words, WordOrder order) {
  const WordPair straight = reordered(words, order);
  return static_cast<std::uint32_t>(straight[0]) << 16 | straight[1];
}

}  // namespace imrig
