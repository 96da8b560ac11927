#include "rig/dyno/register_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "rig/base/error.h"
#include "tests/e2e/command.h"

namespace imrig {
namespace {

using Words = std::vector<std::uint16_t>;

constexpr char kSmall[] = R"(
version = 1
name = "small"
identities = [7]
[registers.identity]
address = 0
[registers.set_V]
address = 8
scale = 0.01
unit = "V"
[registers.output]
address = 18
)";

TEST(RegisterMap, TheBenchSupplyIsAsItsRegisterList) {
  const RegisterMap map = load_register_map("riden_rd6006");
  EXPECT_EQ(map.identities.front(), 60062);
  ASSERT_TRUE(map.find(Role::kSetV) && map.find(Role::kSetA) && map.find(Role::kOutV) &&
              map.find(Role::kOutA));
  EXPECT_EQ(map.find(Role::kIdentity)->address, 0);
  EXPECT_EQ(map.find(Role::kSetV)->address, 8);
  EXPECT_EQ(map.find(Role::kSetA)->address, 9);
  EXPECT_EQ(map.find(Role::kOutV)->address, 10);
  EXPECT_EQ(map.find(Role::kOutA)->address, 11);
  EXPECT_EQ(map.find(Role::kProtection)->address, 16);
  EXPECT_EQ(map.find(Role::kConstantCurrent)->address, 17);
  EXPECT_EQ(map.find(Role::kOutput)->address, 18);
  EXPECT_EQ(map.find(Role::kSetV)->encode(12.34), Words{1234});
  EXPECT_EQ(map.find(Role::kSetA)->encode(1.2346), Words{1235});
  EXPECT_TRUE(map.find(Role::kOutV)->read_only);
  EXPECT_FALSE(map.find(Role::kSetV)->read_only);
}

TEST(RegisterMap, TheProgrammableSupplyCountsInPartsOfItsRating) {
  const RegisterMap map = load_register_map("tdk_genesys");
  EXPECT_EQ(map.find(Role::kSetV)->encode(60.0), Words{53620});
  EXPECT_EQ(map.find(Role::kSetA)->encode(12.5), Words{26810});
  const std::uint16_t half = 26810;
  EXPECT_NEAR(map.find(Role::kSetV)->decode(&half), 30.0, 1e-9);
  EXPECT_EQ(map.find(Role::kWatchdogEnable)->address, 1021);
  EXPECT_EQ(map.find(Role::kWatchdogSeconds)->address, 1022);
  EXPECT_EQ(map.find(Role::kProtection)->address, 935);
  EXPECT_GE(map.watchdog_s, 1.0);
}

TEST(RegisterMap, TheExcitationControllerIsReadInItsWordOrderAndTakesNoSetPoints) {
  const RegisterMap map = load_register_map("basler_decs");
  EXPECT_FALSE(map.takes_setpoints());
  const std::uint16_t words[] = {0x1C00, 0x47BB};
  EXPECT_DOUBLE_EQ(map.find(Role::kOutV)->decode(words), 95800.0);
  EXPECT_EQ(map.find(Role::kOutV)->address + 40001, 47275);
  EXPECT_EQ(map.find(Role::kOutA)->address + 40001, 47277);
}

TEST(RegisterMap, EachKindGoesThereAndBackAndStaysInItsRange) {
  const auto back = [](RegisterKind kind, double value, double scale = 1.0) {
    Register r;
    r.kind = kind;
    r.scale = scale;
    return r.decode(r.encode(value).data());
  };
  EXPECT_EQ(back(RegisterKind::kU16, 65535.0), 65535.0);
  EXPECT_EQ(back(RegisterKind::kU16, 70000.0), 65535.0);
  EXPECT_EQ(back(RegisterKind::kU16, -3.0), 0.0);
  EXPECT_EQ(back(RegisterKind::kU16, std::nan("")), 0.0);
  EXPECT_EQ(back(RegisterKind::kS16, -3.0), -3.0);
  EXPECT_EQ(back(RegisterKind::kS16, -1e9), -32768.0);
  EXPECT_EQ(back(RegisterKind::kU32, 4294967295.0), 4294967295.0);
  EXPECT_EQ(back(RegisterKind::kS32, -123456789.0), -123456789.0);
  EXPECT_NEAR(back(RegisterKind::kF32, -1.5e-3), -1.5e-3, 1e-10);
  EXPECT_NEAR(back(RegisterKind::kU16, 12.3456, 0.01), 12.35, 1e-12);
}

TEST(RegisterMap, WhatDoesNotFitIsRefusedWithASentence) {
  const std::string good = kSmall;
  EXPECT_NO_THROW(parse_register_map(good, "t"));
  const auto refused = [](const std::string& text, const std::string& named) {
    try {
      parse_register_map(text, "t");
    } catch (const Error& e) {
      EXPECT_NE(std::string(e.what()).find(named), std::string::npos) << e.what();
      return true;
    }
    return false;
  };
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    text.replace(text.find(from), from.size(), to);
    return text;
  };
  EXPECT_TRUE(refused(good + "[registers.set_X]\naddress = 3\n", "set_X"));
  EXPECT_TRUE(refused(good + "colour = 3\n", "colour"));
  EXPECT_TRUE(refused(changed("name = \"small\"", "nome = \"small\""), "name"));
  EXPECT_TRUE(refused(changed("version = 1", "version = 2"), "version"));
  EXPECT_TRUE(refused(changed("address = 8", "address = 65536"), "address"));
  EXPECT_TRUE(refused(changed("address = 8", "address = -1"), "address"));
  EXPECT_TRUE(refused(changed("address = 8", "address = 18"), "18"));
  EXPECT_TRUE(refused(changed("scale = 0.01", "scale = 0.0"), "scale"));
  EXPECT_TRUE(refused(changed("scale = 0.01", "kind = \"f64\""), "kind"));
  EXPECT_TRUE(refused(changed("scale = 0.01", "word_order = \"ACBD\""), "word_order"));
  EXPECT_TRUE(refused(changed("unit = \"V\"", "unit = \"mV\""), "unit"));
  EXPECT_TRUE(refused(changed("scale = 0.01", "read_only = true"), "read_only"));
  EXPECT_TRUE(refused(changed("scale = 0.01", "counts_at_rated = 53620"), "rated_V"));
  EXPECT_TRUE(refused(changed("identities = [7]", ""), "identities"));
  EXPECT_TRUE(refused(good.substr(0, good.find("[registers.output]")), "output"));
  EXPECT_TRUE(refused(changed("identities = [7]", "identities = [7]\nwatchdog_s = 2.0"), "watchdog"));
  EXPECT_TRUE(refused("version =", "t"));
}

TEST(RegisterMap, AMapThatIsNotThereIsNamed) {
  EXPECT_THROW(load_register_map("no_such_supply"), Error);
  EXPECT_THROW(load_register_map("/tmp/no/such/map.toml"), Error);
  EXPECT_NO_THROW(load_register_map(test::source("models/registers/riden_rd6006.toml")));
}

}  // namespace
}  // namespace imrig
