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
  // At no load the motor is its stator's whole inductance: V/(w I_0 sin phi), line values of the table's first row, in the star.
  const double L_s = model.at("L_l").at("value").get<double>() + model.at("L_m").at("value").get<double>();
  const double no_load = 400.0 / std::sqrt(3.0) / (2 * M_PI * 50 * 11.0 * std::sqrt(1 - 0.085 * 0.085));
  fmt::print("L_l + L_m: {:.5f} H, from the no-load row {:.5f} H\n", L_s, no_load);
  EXPECT_NEAR(L_s, no_load, 0.02 * no_load);
  const auto compared = run({"imrig", "compare", folder / "m.toml", data, "--json"});
  ASSERT_EQ(compared.exit_code, 0) << compared.err;
  const json record = json::parse(compared.out).at("records").at(0);
  EXPECT_EQ(record.at("kind"), "points");
  EXPECT_LT(record.at("channels").at("current_A").at("nrmse").get<double>(), 0.03);
  EXPECT_LT(record.at("channels").at("input_power_W").at("nrmse").get<double>(), 0.06);
  // The base model has no iron, friction or stray loss: its shaft power must visibly miss the measured one, too much at light load.
  EXPECT_GT(record.at("channels").at("output_power_W").at("nrmse").get<double>(), 0.03);
  const auto text = run({"imrig", "compare", folder / "m.toml", data});
  EXPECT_EQ(text.exit_code, 0);
  for (const char* measured : {"647.8", "2537.4", "1845", "24700", "39.35"}) {
    EXPECT_NE(text.out.find(measured), std::string::npos) << "each measured point is printed; missing " << measured << "\n" << text.out;
  }
}

}  // namespace
}  // namespace imrig::test
