#include "rig/base/rig_config.h"

#include <gtest/gtest.h>

#include "rig/base/error.h"

namespace imrig {
namespace {

TEST(RigConfig, WrittenTextReadsBackToTheSameText) {
  RigConfig config;
  config.motor.R_r_ohm = 0.1 + 0.2;
  config.motor.name = "odd \"name\" \\";
  const std::string text = to_toml(config);
  const RigConfig again = parse_rig_config(text, "rig.toml");
  EXPECT_EQ(again.motor.R_r_ohm, config.motor.R_r_ohm);
  EXPECT_EQ(again.motor.name, config.motor.name);
  EXPECT_EQ(to_toml(again), text);
}

TEST(RigConfig, OmittedValuesKeepTheirDefaults) {
  const RigConfig config = parse_rig_config("version = 1\n[limits]\ncurrent_A = 12\n", "rig.toml");
  EXPECT_EQ(config.limits.current_A, 12.0);
  EXPECT_EQ(config.limits.speed_rpm, LimitsConfig{}.speed_rpm);
}

TEST(RigConfig, UnknownKeysVersionsAndRangesAreRefused) {
  EXPECT_THROW(parse_rig_config("version = 2\n", "rig.toml"), Error);
  EXPECT_THROW(parse_rig_config("", "rig.toml"), Error);
  EXPECT_THROW(parse_rig_config("version = 1\n[limits]\ncurent_A = 12\n", "rig.toml"), Error);
  EXPECT_THROW(parse_rig_config("version = 1\n[limits]\ncurrent_A = -1\n", "rig.toml"), Error);
}

}  // namespace
}  // namespace imrig
