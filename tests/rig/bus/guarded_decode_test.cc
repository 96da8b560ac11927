#include "rig/bus/guarded_decode.h"

#include <gtest/gtest.h>

#include <cstring>
#include <imrig_msg/ack_t.hpp>
#include <imrig_msg/bridge_cmd_t.hpp>
#include <imrig_msg/bridge_status_t.hpp>
#include <imrig_msg/dyno_cmd_t.hpp>
#include <imrig_msg/dyno_status_t.hpp>
#include <imrig_msg/estimate_t.hpp>
#include <imrig_msg/estop_cmd_t.hpp>
#include <imrig_msg/heartbeat_t.hpp>
#include <imrig_msg/lease_cmd_t.hpp>
#include <imrig_msg/lease_t.hpp>

#include "tests/rig/bus/messages.h"

namespace imrig::test {
namespace {

void put_int32(ByteVector& bytes, std::size_t at, std::int64_t value) {
  for (std::size_t k = 0; k < 4; ++k)
    bytes[at + k] = static_cast<std::uint8_t>(static_cast<std::uint64_t>(value) >> (8 * (3 - k)));
}

constexpr std::size_t kVersionAt = 24;

// What must hold of every type.
template <class Message>
void expect_guarded(const Message& message) {
  SCOPED_TRACE(Message::getTypeName());
  const ByteVector good = encoded(message);
  ASSERT_TRUE(guarded_decode<Message>(good));
  EXPECT_EQ(encoded(*guarded_decode<Message>(good)), good);
  for (std::size_t n = 0; n < good.size(); ++n) {
    EXPECT_FALSE(guarded_decode<Message>(Bytes(good).first(n))) << n << " of " << good.size() << " bytes";
  }
  ByteVector bytes = good;
  bytes.push_back(0);
  EXPECT_FALSE(guarded_decode<Message>(bytes)) << "one byte too many";
  bytes = good;
  bytes[3] ^= 1;
  EXPECT_FALSE(guarded_decode<Message>(bytes)) << "fingerprint";
  for (const int version : {0, 2, -1}) {
    bytes = good;
    put_int32(bytes, kVersionAt, version);
    EXPECT_FALSE(guarded_decode<Message>(bytes)) << "version " << version;
  }
  // Any four bytes may be a length: whatever stands there, decoding must come back.
  for (std::size_t at = 8; at + 4 <= good.size(); ++at) {
    for (const std::int64_t length :
         {-1ll, 0x7fffffffll, -0x80000000ll, 0ll, 1ll, 255ll, 256ll, 257ll, 4096ll, 100000ll}) {
      bytes = good;
      put_int32(bytes, at, length);
      const auto decoded = guarded_decode<Message>(bytes);
      EXPECT_TRUE(!decoded || encoded(*decoded) == bytes);
    }
  }
}

template <class Message>
Message with_version(std::int32_t Message::*version) {
  Message message;
  std::memset(&message, 0, sizeof message);
  message.*version = 1;
  return message;
}

TEST(GuardedDecode, TypesOfFixedSizeNeedTheirExactSize) {
  using namespace imrig_msg;
  expect_guarded(with_version(&ack_t::ack_v1));
  expect_guarded(with_version(&bridge_status_t::bridge_status_v1));
  expect_guarded(with_version(&dyno_cmd_t::dyno_cmd_v1));
  expect_guarded(with_version(&dyno_status_t::dyno_status_v1));
  expect_guarded(with_version(&estimate_t::estimate_v1));
  expect_guarded(with_version(&estop_cmd_t::estop_cmd_v1));
  expect_guarded(with_version(&heartbeat_t::heartbeat_v1));
  expect_guarded(with_version(&lease_t::lease_v1));
  expect_guarded(with_version(&lease_cmd_t::lease_cmd_v1));
  const ByteVector command = encoded(with_version(&bridge_cmd_t::bridge_cmd_v1));
  EXPECT_TRUE(guarded_decode<bridge_cmd_t>(command));
  EXPECT_FALSE(guarded_decode<bridge_cmd_t>(Bytes(command).first(command.size() - 1)));
}

TEST(GuardedDecode, TypesWithLengthsInsideAreWalkedFirst) {
  expect_guarded(samples());
  expect_guarded(series());
  expect_guarded(points());
  expect_guarded(record());
  expect_guarded(remark());
  expect_guarded(dataset());
  expect_guarded(campaign_status());
}

TEST(GuardedDecode, LengthsKeepToTheLimitsOfTheirTypes) {
  EXPECT_TRUE(guarded_decode<imrig_msg::samples_t>(encoded(samples(256))));
  EXPECT_FALSE(guarded_decode<imrig_msg::samples_t>(encoded(samples(257))));
  EXPECT_FALSE(guarded_decode<imrig_msg::samples_t>(encoded(samples(0))));
  EXPECT_TRUE(guarded_decode<imrig_msg::series_t>(encoded(series(500))));
  EXPECT_FALSE(guarded_decode<imrig_msg::series_t>(encoded(series(501))));
  EXPECT_TRUE(guarded_decode<imrig_msg::points_t>(encoded(points(500))));
  EXPECT_FALSE(guarded_decode<imrig_msg::points_t>(encoded(points(501))));
}

TEST(GuardedDecode, OptionalColumnsAreWholeOrAbsent) {
  imrig_msg::series_t m = series(4);
  m.n_torque = 3;
  m.torque_Nm.assign(3, 1.0);
  EXPECT_FALSE(guarded_decode<imrig_msg::series_t>(encoded(m)));
  m.n_torque = 4;
  m.torque_Nm.assign(4, 1.0);
  EXPECT_TRUE(guarded_decode<imrig_msg::series_t>(encoded(m)));
}

TEST(GuardedDecode, StringsEndInTheirOnlyZeroByte) {
  EXPECT_TRUE(guarded_decode<imrig_msg::remark_t>(encoded(remark(std::string(4095, 'x')))));
  EXPECT_FALSE(guarded_decode<imrig_msg::remark_t>(encoded(remark(std::string(4096, 'x')))));
  ByteVector bytes = encoded(remark("said"));
  ASSERT_EQ(bytes.back(), 0);
  bytes.back() = 'x';
  EXPECT_FALSE(guarded_decode<imrig_msg::remark_t>(bytes));
  bytes = encoded(remark("said"));
  bytes[bytes.size() - 3] = 0;
  EXPECT_FALSE(guarded_decode<imrig_msg::remark_t>(bytes));
}

TEST(GuardedDecode, TheDatagramThatKillsAPlainSubscriberIsRefused) {
  ByteVector killer = encoded(samples());
  put_int32(killer, killer.size() - 3 * 16 - 4, -1);  // n
  imrig_msg::samples_t plain;
  EXPECT_THROW(plain.decode(killer.data(), 0, static_cast<int>(killer.size())), std::length_error);
  EXPECT_FALSE(guarded_decode<imrig_msg::samples_t>(killer));
}

}  // namespace
}  // namespace imrig::test
