#include "rig/base/toml_text.h"

#include <gtest/gtest.h>

#include "rig/base/rig_config.h"

namespace imrig {
namespace {

TEST(TomlText, QuotesWhatWouldEndOrBreakAString) {
  EXPECT_EQ(toml_quoted("a \"b\" \\ c"), R"("a \"b\" \\ c")");
  EXPECT_EQ(toml_quoted("two\nlines\x7f"), R"("two\u000alines\u007f")");
  EXPECT_EQ(toml_quoted("Ω"), "\"Ω\"");
}

TEST(TomlText, NumbersAreRealOnesAndReadBackToTheSameBits) {
  EXPECT_EQ(toml_number(3.0), "3.0");
  EXPECT_EQ(toml_number(1e20), "1e+20");
  EXPECT_EQ(std::stod(toml_number(0.1 + 0.2)), 0.1 + 0.2);
}

TEST(TomlText, ANameOfAnyKindComesBackFromARigsFile) {
  RigConfig rig;
  rig.motor.name = "the \"old\" one\\\n\ttwo lines";
  EXPECT_EQ(parse_rig_config(to_toml(rig), "test").motor.name, rig.motor.name);
}

}  // namespace
}  // namespace imrig
