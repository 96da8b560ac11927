#include "rig/base/url.h"

#include <gtest/gtest.h>

#include "rig/base/error.h"

namespace imrig {
namespace {

TEST(Url, HostAndPort) {
  const Url url = parse_url("tcp://127.0.0.1:15020");
  EXPECT_EQ(url.scheme, "tcp");
  EXPECT_EQ(url.host, "127.0.0.1");
  EXPECT_EQ(url.port, 15020);
  EXPECT_TRUE(url.path.empty());
  EXPECT_TRUE(url.options.empty());
}

TEST(Url, PathAndOptions) {
  const Url url = parse_url("rtu:///dev/pts/3?baud=115200&unit=7");
  EXPECT_EQ(url.scheme, "rtu");
  EXPECT_TRUE(url.host.empty());
  EXPECT_EQ(url.path, "/dev/pts/3");
  EXPECT_EQ(url.option_or("baud", 9600, 1, 1000000), 115200);
  EXPECT_EQ(url.option_or("unit", 1, 1, 247), 7);
  EXPECT_EQ(url.option_or("parity", 5, 0, 9), 5);
  EXPECT_THROW(url.option_or("unit", 1, 1, 6), Error);
}

TEST(Url, WhatIsNoAddressIsRefusedWithASentence) {
  for (const char* text :
       {"", "tcp", "tcp://", "://x:1", "tcp://host", "tcp://host:", "tcp://:1", "tcp://host:65536",
        "tcp://host:-1", "tcp://host:1x", "tcp://host:1?a", "tcp://host:1?a=", "tcp://host:1?=3",
        "tcp://host:1?a=1&a=2", "tcp://host:1?a=-1", "tcp://host:1?a=99999999999999999999"}) {
    EXPECT_THROW(parse_url(text), Error) << text;
  }
  EXPECT_THROW(parse_url("tcp://" + std::string(2000, 'x') + ":1"), Error);
}

}  // namespace
}  // namespace imrig
