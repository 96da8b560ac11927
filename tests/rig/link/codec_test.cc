// The hand-written codec against lcm-gen's C++ types, both ways, byte by byte.
#include "rig/link/device/codec.h"

#include <gtest/gtest.h>

#include <cstring>
#include <imrig_link/block_t.hpp>
#include <imrig_link/commit_t.hpp>
#include <imrig_link/credit_t.hpp>
#include <imrig_link/device_status_t.hpp>
#include <imrig_link/hello_t.hpp>
#include <imrig_link/order_t.hpp>
#include <imrig_link/reply_t.hpp>
#include <imrig_link/segment_t.hpp>
#include <imrig_link/welcome_t.hpp>
#include <limits>
#include <random>
#include <vector>

namespace imrig {
namespace {

using Bytes = std::vector<std::uint8_t>;

// Every field of both structs with the same random bits; NaN and infinities come up among the special values.
class Filler {
 public:
  explicit Filler(unsigned seed) : random_(seed) {}
  template <class A, class B>
  void operator()(A& ours, B& theirs) {
    static_assert(sizeof(A) == sizeof(B));
    const std::uint64_t bits = random_();
    std::memcpy(&ours, &bits, sizeof ours);
    if constexpr (std::is_floating_point_v<A>) {
      static constexpr A kSpecial[] = {A{0}, A{-0.0}, std::numeric_limits<A>::infinity(),
                                       std::numeric_limits<A>::quiet_NaN(),
                                       std::numeric_limits<A>::denorm_min()};
      ours = random_() % 4 == 0 ? kSpecial[random_() % 5]
                                : static_cast<A>(static_cast<double>(bits) * 1e-12 - 9e6);
    }
    std::memcpy(&theirs, &ours, sizeof ours);
  }

 private:
  std::mt19937_64 random_;
};

template <class T>
Bytes encoded_by_lcm(const T& message) {
  Bytes bytes(static_cast<std::size_t>(message.getEncodedSize()));
  EXPECT_EQ(message.encode(bytes.data(), 0, static_cast<int>(bytes.size())), static_cast<int>(bytes.size()));
  return bytes;
}

// Ours encodes to LCM's bytes; LCM's bytes decode to ours; one byte more, one less or another fingerprint do
// not.
template <class Ours, class Theirs>
void expect_same(const Ours& ours, const Theirs& theirs,
                 std::size_t (*encode)(const Ours*, std::uint8_t*, std::size_t),
                 int (*decode)(const std::uint8_t*, std::size_t, Ours*), imrig_type type) {
  const Bytes expected = encoded_by_lcm(theirs);
  Bytes bytes(expected.size());
  ASSERT_EQ(encode(&ours, bytes.data(), bytes.size()), bytes.size());
  EXPECT_EQ(bytes, expected);
  EXPECT_EQ(encode(&ours, bytes.data(), bytes.size() - 1), 0u);
  EXPECT_EQ(imrig_type_of(expected.data(), expected.size()), type);
  EXPECT_EQ(imrig_fingerprint(type), static_cast<std::uint64_t>(Theirs::getHash()));

  Ours back;
  ASSERT_EQ(decode(expected.data(), expected.size(), &back), 1);
  Bytes again(expected.size());
  ASSERT_EQ(encode(&back, again.data(), again.size()), again.size());
  EXPECT_EQ(again, expected);
  for (std::size_t n = 0; n < expected.size(); ++n) ASSERT_EQ(decode(expected.data(), n, &back), 0) << n;
  Bytes longer = expected;
  longer.push_back(0);
  EXPECT_EQ(decode(longer.data(), longer.size(), &back), 0);
  Bytes other = expected;
  other[7] ^= 1u;
  EXPECT_EQ(decode(other.data(), other.size(), &back), 0);
  EXPECT_EQ(imrig_type_of(other.data(), other.size()), IMRIG_TYPE_NONE);
}

#define SAME(field) fill(ours.field, theirs.field)

class Codec : public testing::TestWithParam<unsigned> {
 protected:
  Filler fill{GetParam()};
};
INSTANTIATE_TEST_SUITE_P(Seeds, Codec, testing::Range(1u, 6u));

TEST_P(Codec, HelloIsTheSameAsLcms) {
  imrig_hello ours = {};
  imrig_link::hello_t theirs;
  SAME(utime), SAME(seq), SAME(hello_v1), SAME(host_nonce), SAME(watchdog_ms), SAME(current_limit_A),
      SAME(speed_limit_rpm), SAME(stator_limit_C), SAME(voltage_limit_V);
  expect_same(ours, theirs, imrig_encode_hello, imrig_decode_hello, IMRIG_TYPE_HELLO);
}

TEST_P(Codec, WelcomeIsTheSameAsLcms) {
  imrig_welcome ours = {};
  imrig_link::welcome_t theirs;
  SAME(utime), SAME(seq), SAME(welcome_v1), SAME(host_nonce), SAME(boot_id), SAME(next_index),
      SAME(next_block), SAME(sample_time_ns), SAME(pwm_time_ns), SAME(current_A_per_count),
      SAME(voltage_V_per_count), SAME(voltage_filter_s), SAME(full_scale_counts),
      SAME(encoder_counts_per_rev), SAME(max_segments), SAME(waits_for_credit);
  expect_same(ours, theirs, imrig_encode_welcome, imrig_decode_welcome, IMRIG_TYPE_WELCOME);
}

TEST_P(Codec, SegmentIsTheSameAsLcms) {
  imrig_segment ours = {};
  imrig_link::segment_t theirs;
  SAME(utime), SAME(seq), SAME(segment_v1), SAME(profile_id), SAME(position), SAME(kind), SAME(record),
      SAME(duration_samples), SAME(amplitude_start_V), SAME(amplitude_end_V), SAME(frequency_start_Hz),
      SAME(frequency_end_Hz), SAME(angle_rad), SAME(offset_A), SAME(n_tones), SAME(kp_V_per_A),
      SAME(ki_V_per_As), SAME(period_samples), SAME(plus_phases), SAME(minus_phases), SAME(level_A),
      SAME(level_V);
  for (int k = 0; k < IMRIG_TONES; ++k) SAME(tone_A[k]), SAME(tone_Hz[k]), SAME(tone_rad[k]);
  expect_same(ours, theirs, imrig_encode_segment, imrig_decode_segment, IMRIG_TYPE_SEGMENT);
}

TEST_P(Codec, CommitIsTheSameAsLcms) {
  imrig_commit ours = {};
  imrig_link::commit_t theirs;
  SAME(utime), SAME(seq), SAME(commit_v1), SAME(profile_id), SAME(n_segments), SAME(at_end);
  expect_same(ours, theirs, imrig_encode_commit, imrig_decode_commit, IMRIG_TYPE_COMMIT);
}

TEST_P(Codec, OrderIsTheSameAsLcms) {
  imrig_order ours = {};
  imrig_link::order_t theirs;
  SAME(utime), SAME(seq), SAME(order_v1), SAME(action), SAME(profile_id), SAME(ramp_s);
  expect_same(ours, theirs, imrig_encode_order, imrig_decode_order, IMRIG_TYPE_ORDER);
}

TEST_P(Codec, CreditIsTheSameAsLcms) {
  imrig_credit ours = {};
  imrig_link::credit_t theirs;
  SAME(utime), SAME(seq), SAME(credit_v1), SAME(until_index);
  expect_same(ours, theirs, imrig_encode_credit, imrig_decode_credit, IMRIG_TYPE_CREDIT);
}

TEST_P(Codec, ReplyIsTheSameAsLcms) {
  imrig_reply ours = {};
  imrig_link::reply_t theirs;
  SAME(utime), SAME(seq), SAME(reply_v1), SAME(of_seq), SAME(result);
  expect_same(ours, theirs, imrig_encode_reply, imrig_decode_reply, IMRIG_TYPE_REPLY);
}

TEST_P(Codec, StatusIsTheSameAsLcms) {
  imrig_status ours = {};
  imrig_link::device_status_t theirs;
  SAME(utime), SAME(seq), SAME(device_status_v1), SAME(boot_id), SAME(next_index), SAME(state), SAME(trip),
      SAME(profile_id), SAME(profile_loaded), SAME(segment), SAME(bad_frames), SAME(current_peak_A),
      SAME(speed_rpm), SAME(stator_C);
  expect_same(ours, theirs, imrig_encode_status, imrig_decode_status, IMRIG_TYPE_STATUS);
}

TEST_P(Codec, BlockIsTheSameAsLcms) {
  for (const int n : {1, 2, 17, 255, 256}) {
    imrig_block ours = {};
    imrig_link::block_t theirs;
    SAME(utime), SAME(seq), SAME(block_v1), SAME(first_index), SAME(profile_id), SAME(segment), SAME(record),
        SAME(gates_on), SAME(stator_C);
    ours.n = theirs.n = n;
    const auto size = static_cast<std::size_t>(n);
    for (auto* column : {&theirs.i_a, &theirs.i_b, &theirs.i_c, &theirs.v_a, &theirs.v_b, &theirs.v_c})
      column->resize(size);
    theirs.encoder.resize(size);
    for (std::size_t k = 0; k < size; ++k) {
      SAME(i_a[k]), SAME(i_b[k]), SAME(i_c[k]), SAME(v_a[k]), SAME(v_b[k]), SAME(v_c[k]), SAME(encoder[k]);
    }
    expect_same(ours, theirs, imrig_encode_block, imrig_decode_block, IMRIG_TYPE_BLOCK);
  }
}

TEST(BlockCodec, RefusesEveryLengthOutOfRange) {
  imrig_block block = {};
  block.n = 2;
  Bytes bytes(60 + 2 * 16);
  ASSERT_EQ(imrig_encode_block(&block, bytes.data(), bytes.size()), bytes.size());
  for (const std::int64_t n : {-1ll, 0ll, 1ll, 3ll, 257ll, 0x7fffffffll, -0x80000000ll}) {
    for (int k = 0; k < 4; ++k)
      bytes[static_cast<std::size_t>(56 + k)] = static_cast<std::uint8_t>(n >> (24 - 8 * k));
    imrig_block back;
    EXPECT_EQ(imrig_decode_block(bytes.data(), bytes.size(), &back), 0) << n;
  }
  Bytes room(8192);
  for (const int n : {0, -1, 257}) {
    block.n = n;
    EXPECT_EQ(imrig_encode_block(&block, room.data(), room.size()), 0u);
  }
}

}  // namespace
}  // namespace imrig
