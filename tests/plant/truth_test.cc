#include "plant/truth.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/plant/bench.h"

namespace imrig::plant {
namespace {

using nlohmann::json;

TEST(Truth, TellsTheParametersInTheInverseGammaCircuit) {
  const PlantConfig c = load_plant_config(std::string(IMRIG_SOURCE_DIR) + "/models/plants/proca_5hp.toml");
  const json truth = json::parse(truth_json(c));
  EXPECT_EQ(truth["version"], 1);
  EXPECT_EQ(truth["circuit"], "inverse-gamma");
  EXPECT_EQ(truth["pole_pairs"], 2);
  EXPECT_NEAR(truth["parameters"]["R_s"]["value"], 0.39, 1e-12);
  EXPECT_NEAR(truth["parameters"]["R_r"]["value"], 0.22, 1e-12);
  EXPECT_NEAR(truth["parameters"]["L_l"]["value"], 0.006, 1e-12);
  EXPECT_NEAR(truth["parameters"]["L_m"]["value"], 0.068, 1e-12);
  EXPECT_EQ(truth["parameters"]["L_m"]["unit"], "H");
  EXPECT_EQ(truth["mechanics"]["J"]["value"], 0.047);
  EXPECT_EQ(truth["effects"]["friction"]["coulomb_Nm"]["value"], 0.25);
  EXPECT_EQ(truth["generator"]["R_load"]["value"], 11.7);
}

// The truth about the sensors is what the samples show: a held current read over many samples.
TEST(Truth, TellsTheSensorErrorsThatTheSamplesShow) {
  PlantConfig c = bench::config();
  c.sensors = SensorsConfig{};
  c.sensors.gain_sigma = 0.02;
  c.seed = 5;
  c.mechanics.locked = true;
  const json sensors = json::parse(truth_json(c))["sensors"];
  Plant plant(c);
  double zero = 0.0, high = 0.0;
  const int n = 2000;
  for (int k = 0; k < n; ++k) zero += plant.step({}).i[1] / static_cast<double>(n);
  bench::hold(plant, bench::command(space_vector(0.0, 6.0, -6.0)), 4.0);
  for (int k = 0; k < n; ++k)
    high += plant.step(bench::command(space_vector(0.0, 6.0, -6.0))).i[1] / static_cast<double>(n);
  const double true_counts = phases(plant.state().i_s)[1] / plant.scale().current_A_per_count;
  EXPECT_NEAR(zero, sensors["current_offset_counts"][1].get<double>(), 0.15);
  EXPECT_NEAR((high - zero) / true_counts, sensors["current_gain"][1].get<double>(), 3e-4);
  EXPECT_GT(std::abs(sensors["current_gain"][1].get<double>() - 1.0), 1e-3);
}

TEST(Truth, SaysTheSameToPeople) {
  const std::string text = truth_text(bench::config());
  EXPECT_THAT(text, testing::HasSubstr("parameters.R_s"));
  EXPECT_THAT(text, testing::HasSubstr("0.39 ohm"));
}

}  // namespace
}  // namespace imrig::plant
