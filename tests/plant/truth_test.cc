#include "plant/truth.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <nlohmann/json.hpp>

#include "plant/effects/current_sensors.h"
#include "plant/effects/inverter_dead_time.h"
#include "plant/effects/voltage_sensors.h"
#include "tests/plant/spectrum.h"

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

ChannelErrors stated(double unit) {
  ChannelErrors e;
  e.gain = {0.01, -0.02, 0.005}, e.offset = {0.02 * unit, -0.01 * unit, 0.03 * unit}, e.crosstalk = 0.01;
  return e;
}

// Drawn and stated errors together, read off held currents and voltages: offset at rest, gain from there.
TEST(Truth, TellsGainAndOffsetOfEachChannelAsAFitFindsThem) {
  PlantConfig c = bench::config();
  c.sensors = SensorsConfig{};
  c.sensors.gain_sigma = 0.01, c.sensors.adc_bits = 16, c.sensors.offset_sigma_counts = 20.0;
  c.mechanics.locked = true;
  c.effects = {std::make_shared<CurrentSensors>(CurrentSensors::Config{stated(10.0), 0.0, 0.0}),
               std::make_shared<VoltageSensors>(stated(100.0))};
  const json sensors = json::parse(truth_json(c))["sensors"];
  Plant plant(c);
  const int n = 4000;
  const auto mean = [&](const InverterCommand& command) {
    std::array<double, 6> sum{};
    for (int k = 0; k < n; ++k) {
      const RawSample raw = plant.step(command);
      for (std::size_t p = 0; p < 3; ++p) {
        sum[p] += raw.i[p] * plant.scale().current_A_per_count / n;
        sum[p + 3] += raw.v[p] * plant.scale().voltage_V_per_count / n;
      }
    }
    return sum;
  };
  const auto zero = mean({});
  const InverterCommand held = bench::command(space_vector(5.0, -1.5, -3.5));
  bench::hold(plant, held, 4.0);
  const auto high = mean(held);
  const auto i = phases(plant.state().i_s), v = phases(plant.state().v_s);
  for (std::size_t p = 0; p < 3; ++p) {
    const std::string phase(1, "abc"[p]);
    EXPECT_NEAR(zero[p], sensors["current"]["offset"][phase]["value"], 2e-3) << phase;
    EXPECT_NEAR(zero[p + 3], sensors["voltage"]["offset"][phase]["value"], 2e-2) << phase;
    EXPECT_NEAR((high[p] - zero[p]) / i[p] - 1.0, sensors["current"]["gain_error"][phase]["value"], 1e-3);
    EXPECT_NEAR((high[p + 3] - zero[p + 3]) / v[p] - 1.0, sensors["voltage"]["gain_error"][phase]["value"],
                2e-2);
  }
}

// Phase of the reading behind the physical value at 50 Hz.
TEST(Truth, TellsTheLagOfEachKindOfChannel) {
  PlantConfig c = bench::held_speed(1440.0);
  c.sensors.voltage_filter_s = 160e-6;
  c.effects = {std::make_shared<CurrentSensors>(CurrentSensors::Config{{}, 80e-6, 60e-6})};
  const json sensors = json::parse(truth_json(c))["sensors"];
  Plant plant(c);
  const bench::Supply supply{50.0, 150.0};
  bench::run(plant, supply, 3.0);
  const int n = 16667;
  bench::Complex i = 0.0, v = 0.0, i_true = 0.0, v_true = 0.0;
  for (int k = 0; k < n; ++k) {
    const RawSample raw = plant.step(supply.at(plant));
    const auto back = std::polar(1.0, -2.0 * kPi * 50.0 * 60e-6 * k);
    i += back * space_vector(raw.i[0], raw.i[1], raw.i[2]),
        v += back * space_vector(raw.v[0], raw.v[1], raw.v[2]);
    i_true += back * plant.state().i_s, v_true += back * plant.state().v_mean;
  }
  const double w = 2.0 * kPi * 50.0;
  EXPECT_NEAR(std::arg(i_true / i) / w, sensors["current"]["lag"]["value"], 1e-6);
  // A held step's value belongs to its middle, half a sample before the converters read.
  EXPECT_NEAR(std::arg(v_true / v) / w + 30e-6, sensors["voltage"]["lag"]["value"], 3e-6);
}

// Two direct currents through a locked motor: what of the command is not R_s i is (4/3) of a phase's lost
// step, and what grows with the current.
TEST(Truth, TellsWhatTheInverterLosesOnTheWayToTheTerminals) {
  PlantConfig c = bench::held_speed(0.0);
  c.effects = {std::make_shared<InverterDeadTime>(InverterDeadTime::Config{3e-6, 1.2, 0.05, 0.05})};
  const json inverter = json::parse(truth_json(c))["inverter"];
  const auto current = [&](double volts) {
    Plant plant(c);
    bench::hold(plant, bench::command(volts), 8.0);
    return plant.state().i_s.real();
  };
  const double i_1 = current(12.0), i_2 = current(16.0);
  const double R = (16.0 - 12.0) / (i_2 - i_1), step_V = 0.75 * (12.0 - R * i_1);
  EXPECT_NEAR(inverter["dead_time_voltage"]["value"], 400.0 * 3e-6 / 240e-6, 1e-12);
  EXPECT_NEAR(
      step_V,
      inverter["dead_time_voltage"]["value"].get<double>() + inverter["device_drop"]["value"].get<double>(),
      1e-3);
  EXPECT_NEAR(R - bench::kRs, inverter["device_resistance"]["value"], 1e-4);
}

TEST(Truth, HasNoErrorsWhereThereAreNone) {
  const json truth = json::parse(truth_json(bench::config()));
  for (const char* kind : {"current", "voltage"}) {
    for (const char* phase : {"a", "b", "c"}) {
      EXPECT_EQ(truth["sensors"][kind]["gain_error"][phase]["value"], 0.0);
      EXPECT_EQ(truth["sensors"][kind]["offset"][phase]["value"], 0.0);
    }
  }
  EXPECT_EQ(truth["sensors"]["current"]["lag"]["value"], 0.0);
  EXPECT_EQ(truth["inverter"]["dead_time_voltage"]["value"], 0.0);
}

TEST(Truth, SaysTheSameToPeople) {
  const std::string text = truth_text(bench::config());
  EXPECT_THAT(text, testing::HasSubstr("parameters.R_s"));
  EXPECT_THAT(text, testing::HasSubstr("0.39 ohm"));
}

}  // namespace
}  // namespace imrig::plant
