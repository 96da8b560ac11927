#include "rig/link/device/cobs.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace imrig {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes encode(const Bytes& in) {
  Bytes out(IMRIG_COBS_MAX(in.size()));
  out.resize(imrig_cobs_encode(in.data(), in.size(), out.data(), out.size()));
  return out;
}

Bytes decode(Bytes in) {
  in.resize(imrig_cobs_decode(in.data(), in.size(), in.data(), in.size()));
  return in;
}

Bytes counting(int first, int last) {
  Bytes bytes;
  for (int k = first; k <= last; ++k) bytes.push_back(static_cast<std::uint8_t>(k));
  return bytes;
}

Bytes joined(Bytes a, const Bytes& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

// The eleven examples of https://en.wikipedia.org/wiki/Consistent_Overhead_Byte_Stuffing, without their
// closing 00.
TEST(Cobs, EncodesThePublishedExamples) {
  const std::vector<std::pair<Bytes, Bytes>> examples = {
      {{0x00}, {0x01, 0x01}},
      {{0x00, 0x00}, {0x01, 0x01, 0x01}},
      {{0x00, 0x11, 0x00}, {0x01, 0x02, 0x11, 0x01}},
      {{0x11, 0x22, 0x00, 0x33}, {0x03, 0x11, 0x22, 0x02, 0x33}},
      {{0x11, 0x22, 0x33, 0x44}, {0x05, 0x11, 0x22, 0x33, 0x44}},
      {{0x11, 0x00, 0x00, 0x00}, {0x02, 0x11, 0x01, 0x01, 0x01}},
      {counting(0x01, 0xFE), joined({0xFF}, counting(0x01, 0xFE))},
      {counting(0x00, 0xFE), joined({0x01, 0xFF}, counting(0x01, 0xFE))},
      {counting(0x01, 0xFF), joined(joined({0xFF}, counting(0x01, 0xFE)), {0x02, 0xFF})},
      {joined(counting(0x02, 0xFF), {0x00}), joined(joined({0xFF}, counting(0x02, 0xFF)), {0x01, 0x01})},
      {joined(counting(0x03, 0xFF), {0x00, 0x01}),
       joined(joined({0xFE}, counting(0x03, 0xFF)), {0x02, 0x01})}};
  for (const auto& [plain, encoded] : examples) {
    EXPECT_EQ(encode(plain), encoded);
    EXPECT_EQ(decode(encoded), plain);
  }
}

TEST(Cobs, EveryBytesComeBackAndNoneIsZeroOnTheWire) {
  std::mt19937 random(7);
  for (int run = 0; run < 3000; ++run) {
    Bytes plain(1 + random() % 1100);
    const unsigned zeros = run % 3 == 0 ? 256 : (run % 3 == 1 ? 2 : 100000);  // one byte in so many
    for (auto& byte : plain)
      byte = random() % zeros == 0 ? std::uint8_t{0} : static_cast<std::uint8_t>(1 + random() % 255);
    const Bytes encoded = encode(plain);
    ASSERT_LE(encoded.size(), IMRIG_COBS_MAX(plain.size()));
    ASSERT_EQ(std::count(encoded.begin(), encoded.end(), 0), 0);
    ASSERT_EQ(decode(encoded), plain);
  }
}

TEST(Cobs, RefusesWhatIsNoneAndWhatDoesNotFit) {
  EXPECT_TRUE(decode({0x05, 0x11, 0x22}).empty());  // group longer than the bytes
  EXPECT_TRUE(decode({0x03, 0x11, 0x00}).empty());  // a zero inside
  EXPECT_TRUE(decode({0x00}).empty());
  Bytes out(3);
  const Bytes four = {0x05, 0x11, 0x22, 0x33, 0x44};
  EXPECT_EQ(imrig_cobs_decode(four.data(), four.size(), out.data(), out.size()), 0u);
  EXPECT_EQ(imrig_cobs_encode(four.data(), four.size(), out.data(), out.size()), 0u);
}

}  // namespace
}  // namespace imrig
