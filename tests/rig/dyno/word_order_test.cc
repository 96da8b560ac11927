#include "rig/dyno/word_order.h"

#include <gtest/gtest.h>

#include <bit>

namespace imrig {
namespace {

constexpr WordOrder kAll[] = {WordOrder::kABCD, WordOrder::kCDAB, WordOrder::kBADC, WordOrder::kDCBA};

TEST(WordOrder, TheKnownBytesOfAFloatInAllFourOrders) {
  const auto value = std::bit_cast<std::uint32_t>(1.234f);
  ASSERT_EQ(value, 0x3F9DF3B6u);
  EXPECT_EQ(words_of(value, WordOrder::kABCD), (WordPair{0x3F9D, 0xF3B6}));
  EXPECT_EQ(words_of(value, WordOrder::kCDAB), (WordPair{0xF3B6, 0x3F9D}));
  EXPECT_EQ(words_of(value, WordOrder::kBADC), (WordPair{0x9D3F, 0xB6F3}));
  EXPECT_EQ(words_of(value, WordOrder::kDCBA), (WordPair{0xB6F3, 0x9D3F}));
}

TEST(WordOrder, TheExcitationControllersExampleReadsBack) {
  EXPECT_EQ(std::bit_cast<float>(value_of({0x1C00, 0x47BB}, WordOrder::kCDAB)), 95800.0f);
}

TEST(WordOrder, EveryOrderIsUndoneByReading) {
  for (const WordOrder order : kAll) {
    for (const std::uint32_t value : {0u, 1u, 0x12345678u, 0xFFFFFFFFu, 0x80000000u, 0x00FF00FFu}) {
      EXPECT_EQ(value_of(words_of(value, order), order), value);
    }
  }
}

}  // namespace
}  // namespace imrig
