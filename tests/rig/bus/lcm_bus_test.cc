#include <gtest/gtest.h>
#include <sched.h>
#include <sys/wait.h>

#include <imrig_msg/ack_t.hpp>

#include "rig/base/error.h"
#include "rig/bus/bus.h"
#include "rig/bus/channels.h"
#include "tests/rig/bus/messages.h"
#include "tests/rig/bus/wire.h"

namespace imrig::test {
namespace {

imrig_msg::ack_t ack(std::int64_t seq) {
  imrig_msg::ack_t m = {};
  m.ack_v1 = 1;
  m.seq = seq;
  return m;
}

std::string complaint_of(const std::function<void()>& body) {
  try {
    body();
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

TEST(LcmBus, MessageGoesFromOneBusToTheOther) {
  const int port = free_udp_port();
  const auto talker = open_lcm_bus(bus_config(port));
  const auto listener = open_lcm_bus(bus_config(port));
  std::int64_t heard = 0;
  subscribe<imrig_msg::ack_t>(*listener, channel::kAck, [&](const imrig_msg::ack_t& m) { heard = m.seq; });
  publish(*talker, channel::kAck, ack(42));
  EXPECT_TRUE(wait_until(*listener, [&] { return heard == 42; }));
}

TEST(LcmBus, SlowHandlerLosesNothingOfABurst) {
  const int port = free_udp_port();
  const auto talker = open_lcm_bus(bus_config(port));
  const auto listener = open_lcm_bus(bus_config(port));
  std::vector<std::int64_t> heard;
  subscribe<imrig_msg::ack_t>(*listener, channel::kAck, [&](const imrig_msg::ack_t& m) {
    if (heard.size() % 100 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(2));
    heard.push_back(m.seq);
  });
  constexpr std::int64_t kBurst = 5000;
  for (std::int64_t k = 0; k < kBurst; ++k) {
    publish(*talker, channel::kAck, ack(k));
    if (k % 100 == 99) {
      ASSERT_TRUE(let_kernel_drain(port));
    }
  }
  ASSERT_TRUE(wait_until(*listener, [&] { return heard.size() == kBurst; }));
  for (std::int64_t k = 0; k < kBurst; ++k) EXPECT_EQ(heard[static_cast<std::size_t>(k)], k);
}

TEST(LcmBus, OneWaitHandlesAllThatIsThere) {
  const int port = free_udp_port();
  const auto talker = open_lcm_bus(bus_config(port));
  const auto listener = open_lcm_bus(bus_config(port));
  int heard = 0;
  listener->subscribe_raw("*", [&](std::string_view, Bytes) { ++heard; });
  // LCM's own thread has to get its turn before all of them are there: on a busy machine not at the first
  // attempt.
  bool at_once = false;
  for (int attempt = 0; attempt < 50 && !at_once; ++attempt) {
    heard = 0;
    for (int k = 0; k < 100; ++k) publish(*talker, channel::kAck, ack(k));
    ASSERT_TRUE(let_kernel_drain(port));
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    at_once = listener->wait(5000) == 100 && heard == 100;
    ASSERT_TRUE(wait_until(*listener, [&] { return heard == 100; }));
  }
  EXPECT_TRUE(at_once);
  EXPECT_EQ(listener->wait(0), 0);
}

TEST(LcmBus, NamesAreTakenLiterallyAndStarMeansAnyPrefix) {
  const int port = free_udp_port();
  const auto odd = open_lcm_bus(bus_config(port, "A.B+"));
  const auto other = open_lcm_bus(bus_config(port, "AxBB"));
  std::vector<std::string> literal;
  std::vector<std::string> any;
  odd->subscribe_raw("ACK", [&](std::string_view name, Bytes) { literal.emplace_back(name); });
  odd->subscribe_raw("*", [&](std::string_view name, Bytes) { any.emplace_back(name); });
  publish(*other, "ACK", ack(1));
  publish(*odd, "ACK2", ack(2));
  publish(*odd, "ACK", ack(3));
  ASSERT_TRUE(wait_until(*odd, [&] { return any.size() == 3 && !literal.empty(); }));
  EXPECT_EQ(any, (std::vector<std::string>{"AxBB_ACK", "A.B+_ACK2", "A.B+_ACK"}));
  EXPECT_EQ(literal, std::vector<std::string>{"A.B+_ACK"});
}

TEST(LcmBus, WhatLcmAsksItselfIsNotHeard) {
  const int port = free_udp_port();
  const auto listener = open_lcm_bus(bus_config(port));
  std::vector<std::string> heard;
  listener->subscribe_raw("*", [&](std::string_view name, Bytes) { heard.emplace_back(name); });
  const auto other = open_lcm_bus(bus_config(port));
  other->subscribe_raw("ACK", [](std::string_view, Bytes) {});  // sends LCM_SELF_TEST
  publish(*other, "ACK", ack(1));
  ASSERT_TRUE(wait_until(*listener, [&] { return !heard.empty() && heard.back() == "IMRIG_ACK"; }));
  EXPECT_EQ(heard.size(), 1u);
}

TEST(LcmBus, MalformedDatagramsNeitherKillNorReachTheHandler) {
  const int port = free_udp_port();
  const auto listener = open_lcm_bus(bus_config(port));
  std::int64_t bad = 0;
  std::int64_t good = 0;
  subscribe<imrig_msg::samples_t>(
      *listener, channel::kSamples, [&](const imrig_msg::samples_t&) { ++good; }, &bad);
  RawSender sender(port);
  ByteVector killer = encoded(samples());
  const std::size_t n_at = killer.size() - 3 * 16 - 4;
  for (std::size_t k = 0; k < 4; ++k) killer[n_at + k] = 0xff;
  sender.message("IMRIG_SAMPLES", killer);
  sender.message("IMRIG_SAMPLES", {});
  sender.message("IMRIG_SAMPLES", Bytes(killer).first(20));
  sender.bytes(ByteVector{'L', 'C', '0', '2', 0, 0, 0, 1});  // no channel
  sender.bytes(ByteVector{'L', 'C', '0', '3', 0, 0, 0, 1, 0xff, 0xff, 0xff, 0xff, 0,
                          0});  // a piece of a fragmented message
  sender.bytes(ByteVector(2000, 0xaa));
  sender.message("IMRIG_SAMPLES", encoded(samples()));
  EXPECT_TRUE(wait_until(*listener, [&] { return good == 1; }));
  EXPECT_EQ(bad, 3);
}

TEST(LcmBus, ExceptionOfAHandlerComesOutOfWait) {
  const int port = free_udp_port();
  const auto bus = open_lcm_bus(bus_config(port));
  bus->subscribe_raw("ACK", [](std::string_view, Bytes) { throw Error("handler", "broke"); });
  publish(*bus, "ACK", ack(1));
  EXPECT_THROW(wait_until(
                   *bus, [] { return false; }, 20),
               Error);
  EXPECT_EQ(bus->wait(0), 0);
}

TEST(LcmBus, BadUrlsAreSaidInOneSentence) {
  for (const char* url : {"", "garbage", "foo://239.255.76.77:7790", "udpm://", "udpm://239.255.76.77:0",
                          "udpm://239.255.76.77:99999", "udpm://10.0.0.1:7790", "udpm://host:7790",
                          "udpm://239.255.76.77:7790?tll=0", "udpm://239.255.76.77:7790?ttl=x"}) {
    const std::string text = complaint_of([&] { open_lcm_bus({url, "IMRIG"}); });
    EXPECT_FALSE(text.empty()) << url;
    EXPECT_EQ(text.find('\n'), std::string::npos);
  }
}

// In a network namespace of its own there is no route at all.
TEST(LcmBus, MissingMulticastRouteSaysHowToAddOne) {
  const int child = ::fork();
  if (child == 0) {
    if (::unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0 && ::unshare(CLONE_NEWNET) != 0) ::_exit(77);
    const std::string text = complaint_of([] { open_lcm_bus(bus_config(7790)); });
    ::_exit(text.find("ip route add 224.0.0.0/4 dev lo") != std::string::npos ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  if (WIFEXITED(status) && WEXITSTATUS(status) == 77) GTEST_SKIP() << "no network namespaces here";
  EXPECT_EQ(status, 0);
}

TEST(MemoryBus, DeliversInOrderWithoutLossAndOnlyToSubscribers) {
  const auto hub = make_memory_hub();
  const auto a = open_memory_bus(hub);
  const auto b = open_memory_bus(hub);
  const auto foreign = open_memory_bus(hub, "OTHER");
  publish(*a, channel::kAck, ack(-1));  // nobody listens yet
  std::vector<std::int64_t> heard;
  std::vector<std::string> all;
  subscribe<imrig_msg::ack_t>(*b, channel::kAck, [&](const imrig_msg::ack_t& m) { heard.push_back(m.seq); });
  b->subscribe_raw("*", [&](std::string_view name, Bytes) { all.emplace_back(name); });
  for (int k = 0; k < 3; ++k) publish(*a, channel::kAck, ack(k));
  publish(*foreign, channel::kAck, ack(9));
  EXPECT_EQ(b->wait(0), 4);
  EXPECT_EQ(heard, (std::vector<std::int64_t>{0, 1, 2}));
  EXPECT_EQ(all.back(), "OTHER_ACK");
  EXPECT_EQ(b->wait(1), 0);
}

}  // namespace
}  // namespace imrig::test
