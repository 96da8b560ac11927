#include "rig/base/config_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "rig/base/error.h"

namespace imrig {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

TEST(ConfigReader, UnknownKeyIsNamedWithItsLine) {
  const auto reader = ConfigReader::from_text("a = 1\nb = 2\n", "x.toml");
  EXPECT_EQ(reader.number("a"), 1.0);
  EXPECT_THAT([&] { reader.finish(); }, ThrowsMessage<Error>(HasSubstr("x.toml:2: b is not known here")));
}

TEST(ConfigReader, UnknownKeyInATableIsFound) {
  const auto reader = ConfigReader::from_text("[t]\na = 1\nodd = 2\n", "x.toml");
  reader.table("t").number("a");
  EXPECT_THAT([&] { reader.finish(); }, ThrowsMessage<Error>(HasSubstr("x.toml:3: t.odd is not known here")));
}

TEST(ConfigReader, WrongTypeAndRangeSayWhatWouldBeRight) {
  const auto reader = ConfigReader::from_text("a = \"x\"\nb = 7\nc = nan\nd = 1.5\n", "x.toml");
  EXPECT_THAT([&] { reader.number("a"); }, ThrowsMessage<Error>(HasSubstr("x.toml:1: a is a text; it must be")));
  EXPECT_THAT([&] { reader.number("b", {0, 5}); },
              ThrowsMessage<Error>(HasSubstr("b is 7; it must be a number from 0 to 5")));
  EXPECT_THROW(reader.number("c"), Error);
  EXPECT_THAT([&] { reader.integer("d"); }, ThrowsMessage<Error>(HasSubstr("whole number")));
  EXPECT_THAT([&] { reader.number("e"); }, ThrowsMessage<Error>(HasSubstr("e is missing")));
}

TEST(ConfigReader, BrokenTomlNamesFileAndLine) {
  EXPECT_THAT([] { ConfigReader::from_text("a = 1\nb = [\n", "x.toml"); }, ThrowsMessage<Error>(HasSubstr("x.toml:")));
}

TEST(ConfigReader, ArraysOfTablesKeepTheirOrder) {
  const auto reader = ConfigReader::from_text("[[r]]\nid = \"p\"\n[[r]]\nid = \"q\"\n", "x.toml");
  const auto rows = reader.tables("r");
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].text("id"), "p");
  EXPECT_EQ(rows[1].text("id"), "q");
  reader.finish();
}

}  // namespace
}  // namespace imrig
