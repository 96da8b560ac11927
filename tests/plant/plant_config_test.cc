#include "plant/plant_config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "plant/effects/effect.h"
#include "plant/plant.h"
#include "plant/truth.h"
#include "rig/base/error.h"

namespace imrig::plant {
namespace {

using testing::HasSubstr;

const std::string kFolder = std::string(IMRIG_SOURCE_DIR) + "/models/plants/";

const std::string kMotor = R"(version = 1
[motor]
circuit = "inverse-gamma"
pole_pairs = 2
R_s_ohm = 0.39
R_r_ohm = 0.22
L_l_H = 0.006
L_m_H = 0.068
)";

std::string complaint(const std::string& text) {
  try {
    parse_plant_config(text, "plant.toml");
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(PlantConfig, ReadsTheShippedPlants) {
  const PlantConfig real = load_plant_config(kFolder + "proca_5hp.toml");
  const PlantConfig ideal = load_plant_config(kFolder + "proca_5hp_ideal.toml");
  EXPECT_FALSE(real.sensors.ideal);
  EXPECT_TRUE(ideal.sensors.ideal);
  EXPECT_EQ(real.sample_time_ns, 60000);
  EXPECT_EQ(real.pwm_time_ns, 240000);
  EXPECT_EQ(real.integrator.kind, IntegratorConfig::Kind::kSundials);
  ASSERT_EQ(real.effects.size(), 1u);
  EXPECT_EQ(real.effects[0]->name(), "friction");
  for (const PlantConfig* c : {&real, &ideal}) {
    const InverseGamma g = inverse_gamma_truth(*c);
    EXPECT_NEAR(g.R_s_ohm, 0.39, 1e-12);
    EXPECT_NEAR(g.R_r_ohm, 0.22, 1e-12);
    EXPECT_NEAR(g.L_l_H, 0.006, 1e-12);
    EXPECT_NEAR(g.L_m_H, 0.068, 1e-12);
    EXPECT_EQ(c->machine.pole_pairs, 2);
    EXPECT_NO_THROW(Plant{*c});
  }
}

TEST(PlantConfig, TakesTheTCircuitAsItIs) {
  const PlantConfig c = parse_plant_config(R"(version = 1
integrator = "rk4"
[motor]
circuit = "t"
pole_pairs = 3
R_s_ohm = 0.56
R_r_ohm = 0.78
L_s_H = 0.046
L_r_H = 0.046
L_m_H = 0.039
)",
                                           "plant.toml");
  EXPECT_EQ(c.integrator.kind, IntegratorConfig::Kind::kRk4);
  EXPECT_EQ(c.machine.pole_pairs, 3);
  // Fang, Lin and Wang's motor: L_l = L_s - L_m^2/L_r, R_r scaled by (L_m/L_r)^2.
  const InverseGamma g = inverse_gamma_truth(c);
  EXPECT_NEAR(g.L_l_H, 0.046 - 0.039 * 0.039 / 0.046, 1e-15);
  EXPECT_NEAR(g.L_m_H, 0.039 * 0.039 / 0.046, 1e-15);
  EXPECT_NEAR(g.R_r_ohm, 0.78 * std::pow(0.039 / 0.046, 2), 1e-15);
}

TEST(PlantConfig, NamesAnUnknownKey) {
  EXPECT_THAT(complaint(kMotor + "[mechanics]\nJ_kgm = 0.1\n"), HasSubstr("J_kgm"));
  EXPECT_THAT(complaint(kMotor + "[effects.magic]\n"), HasSubstr("magic"));
  EXPECT_THAT(complaint(kMotor + "[effects.friction]\ncolumb_Nm = 0.1\n"), HasSubstr("columb_Nm"));
}

TEST(PlantConfig, AsksForTheMotor) {
  EXPECT_THAT(complaint("version = 1\n"), HasSubstr("motor"));
  EXPECT_THAT(complaint("version = 2\n"), HasSubstr("version"));
  EXPECT_THAT(
      complaint("version = 1\n[motor]\ncircuit = \"gamma\"\npole_pairs = 2\nR_s_ohm = 1\nR_r_ohm = 1\n"),
      HasSubstr("circuit"));
}

TEST(PlantConfig, RefusesWhatIsNoMachine) {
  EXPECT_THAT(complaint("version = 1\n[motor]\ncircuit = \"t\"\npole_pairs = 2\nR_s_ohm = 1\nR_r_ohm = "
                        "1\nL_s_H = 0.05\nL_r_H = 0.05\nL_m_H = 0.06\n"),
              HasSubstr("L_m^2 < L_s L_r"));
  EXPECT_THAT(complaint(kMotor + "[generator]\nL_field_H = 3\n"), HasSubstr("L_field_H"));
  EXPECT_THAT(complaint("version = 1\npwm_time_ns = 100000\n" + kMotor.substr(12)), HasSubstr("pwm_time_ns"));
}

TEST(PlantConfig, RefusesACircuitFasterThanTheSampleTime) {
  EXPECT_THAT(complaint(kMotor + "[generator]\nR_load_ohm = 500\n"),
              HasSubstr("settles faster than the sample time"));
  EXPECT_EQ(complaint(kMotor + "[generator]\nR_load_ohm = 30\n"), "");
}

TEST(PlantConfig, TakesTheStepOfTheResistorBoxThatIsIn) {
  const std::string box = kMotor + "[generator]\nbox_steps_ohm = [30, 23.4, 11.7]\n";
  EXPECT_EQ(parse_plant_config(box, "plant.toml").generator.R_load_ohm, 30.0);
  EXPECT_EQ(parse_plant_config(box + "box_step = 3\n", "plant.toml").generator.R_load_ohm, 11.7);
  EXPECT_THAT(complaint(box + "box_step = 4\n"), HasSubstr("box_step"));
  EXPECT_THAT(complaint(box + "R_load_ohm = 10\n"), HasSubstr("box_steps_ohm"));
  EXPECT_THAT(complaint(kMotor + "[generator]\nbox_step = 1\n"), HasSubstr("box_step"));
}

TEST(PlantConfig, SaysWhatIsWrongWithItsNumbers) {
  EXPECT_THAT(complaint(kMotor + "[sensors]\nadc_bits = 99\n"), HasSubstr("adc_bits"));
  EXPECT_THAT(complaint(kMotor + "[sensors]\ncurrent_range_A = nan\n"), HasSubstr("current_range_A"));
  EXPECT_THAT(complaint("integrator = \"euler\"\n" + kMotor), HasSubstr("integrator"));
  EXPECT_THROW(load_plant_config(kFolder + "absent.toml"), Error);
}

}  // namespace
}  // namespace imrig::plant
