// The measured 18.5 kW motor (tests/data/motor_18k5): table -> model -> comparison per point, through the command line.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/e2e/command.h"

namespace imrig::test {
namespace {

using nlohmann::json;

TEST(MeasuredMotor, IsIdentifiedFromItsTableAndItsMisfitStaysVisible) {
  const Folder folder;
  const std::string data = source("tests/data/motor_18k5");
  const auto identified = run({"imrig", "identify", data, "--out", folder / "m.toml", "--json"});
  ASSERT_EQ(identified.exit_code, 0) << identified.err;
  const json model = json::parse(identified.out).at("model");
  // Published (T circuit, per delta phase, 20 degC; star-equivalent is a third): L_s = (1.52 + 66.4)/w, so L_l + L_m = 72.1 mH in the star.
  const double L_s = model.at("L_l").at("value").get<double>() + model.at("L_m").at("value").get<double>();
  const double published = (1.52 + 66.4) / (2 * M_PI * 50) / 3;
  fmt::print("L_l + L_m: {:.5f} H, published {:.5f} H\n", L_s, published);
  EXPECT_NEAR(L_s, published, 0.05 * published);
  const auto compared = run({"imrig", "compare", folder / "m.toml", data, "--json"});
  ASSERT_EQ(compared.exit_code, 0) << compared.err;
  const json record = json::parse(compared.out).at("records").at(0);
  EXPECT_EQ(record.at("kind"), "points");
  EXPECT_LT(record.at("channels").at("current_A").at("nrmse").get<double>(), 0.03);
  EXPECT_LT(record.at("channels").at("input_power_W").at("nrmse").get<double>(), 0.06);
  // The base model has no iron, friction or stray loss: what is left must be many times the measurement's noise.
  EXPECT_GT(record.at("channels").at("input_power_W").at("chi2_per_dof").get<double>(), 3.0);
  const auto text = run({"imrig", "compare", folder / "m.toml", data});
  EXPECT_EQ(text.exit_code, 0);
  EXPECT_NE(text.out.find("11.0"), std::string::npos) << "each point's measured current is printed\n" << text.out;
}

}  // namespace
}  // namespace imrig::test
