#include "rig/link/device/frame.h"

#include <gtest/gtest.h>

#include <numeric>
#include <string>
#include <vector>

#include "rig/link/device/crc32.h"
#include "rig/link/frame_reader.h"

namespace imrig {
namespace {

using Bytes = std::vector<std::uint8_t>;

std::uint32_t crc_of(const std::string& text) {
  const Bytes bytes(text.begin(), text.end());
  return imrig_crc32(bytes.data(), bytes.size());
}

Bytes frame_of_payload(Bytes payload) {
  const std::size_t n = payload.size();
  payload.resize(n + IMRIG_CRC_BYTES);
  Bytes frame(IMRIG_COBS_MAX(payload.size()) + 2);
  frame.resize(imrig_frame_write(payload.data(), n, frame.data(), frame.size()));
  return frame;
}

// Check value of CRC-32/ISO-HDLC in Cook's catalogue of parametrised CRC algorithms; the others from RFC
// 3720-style tables of zlib's crc32.
TEST(Crc32, GivesThePublishedValues) {
  EXPECT_EQ(crc_of("123456789"), 0xCBF43926u);
  EXPECT_EQ(crc_of(""), 0u);
  EXPECT_EQ(crc_of("a"), 0xE8B7BE43u);
  EXPECT_EQ(crc_of("The quick brown fox jumps over the lazy dog"), 0x414FA339u);
}

TEST(Frame, HoldsTheCrcBigEndianBetweenZeros) {
  const Bytes payload = {'1', '2', '3', '4', '5', '6', '7', '8', '9'};
  const Bytes frame = frame_of_payload(payload);
  EXPECT_EQ(frame, (Bytes{0, 14, '1', '2', '3', '4', '5', '6', '7', '8', '9', 0xCB, 0xF4, 0x39, 0x26, 0}));
}

TEST(Frame, OfTheLongestPayloadFitsTheStatedMaximum) {
  const Bytes longest(IMRIG_PAYLOAD_MAX, 0x55);
  EXPECT_LE(frame_of_payload(longest).size(), IMRIG_FRAME_MAX);
}

TEST(Frame, WithAnyBitWrongIsRefusedAndCostsNoOther) {
  Bytes payload(40);
  std::iota(payload.begin(), payload.end(), std::uint8_t{0});
  const Bytes good = frame_of_payload(payload);
  for (std::size_t bit = 8; bit < 8 * good.size(); ++bit) {
    Bytes bad = good;
    bad[bit / 8] = static_cast<std::uint8_t>(bad[bit / 8] ^ (1u << (bit % 8)));
    FrameReader reader;
    int taken = 0;
    reader.feed(bad, [&](auto) { ++taken; });
    EXPECT_EQ(taken, 0) << "bit " << bit;
    EXPECT_LE(reader.bad_frames(), 2);
    reader.feed(good, [&](auto) { ++taken; });
    EXPECT_EQ(taken, 1) << "bit " << bit << " cost the next frame too";
    EXPECT_GE(reader.bad_frames(), 1);
  }
}

TEST(FrameReader, FindsFramesHoweverTheyAreCutAndSkipsGarbage) {
  const Bytes one = {1, 0, 2}, two = {9, 9, 0, 0};
  Bytes stream = {7, 7, 7, 0, 0, 0};  // garbage, then idle zeros
  for (const Bytes& payload : {one, two, one}) {
    const Bytes frame = frame_of_payload(payload);
    stream.insert(stream.end(), frame.begin(), frame.end());
  }
  for (std::size_t piece = 1; piece <= stream.size(); ++piece) {
    FrameReader reader;
    std::vector<Bytes> found;
    for (std::size_t at = 0; at < stream.size(); at += piece) {
      const std::size_t n = std::min(piece, stream.size() - at);
      reader.feed({stream.data() + at, n},
                  [&](auto payload) { found.emplace_back(payload.begin(), payload.end()); });
    }
    EXPECT_EQ(found, (std::vector<Bytes>{one, two, one}));
    EXPECT_EQ(reader.bad_frames(), 1);
  }
}

TEST(FrameReader, DropsWhatIsLongerThanTheLongestFrameAndGoesOn) {
  FrameReader reader;
  Bytes stream(3 * IMRIG_FRAME_MAX, 0x11);
  stream.push_back(0);
  const Bytes frame = frame_of_payload({5, 6});
  stream.insert(stream.end(), frame.begin(), frame.end());
  int taken = 0;
  reader.feed(stream, [&](auto payload) { taken += static_cast<int>(payload.size()); });
  EXPECT_EQ(taken, 2);
  EXPECT_EQ(reader.bad_frames(), 1);
}

}  // namespace
}  // namespace imrig
