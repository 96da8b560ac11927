// Errors of the sensors with stated sizes.

#include <gtest/gtest.h>

#include <cstdio>
#include <memory>

#include "plant/effects/current_sensors.h"
#include "plant/effects/encoder_eccentricity.h"
#include "plant/effects/thermocouple.h"
#include "plant/effects/voltage_sensors.h"
#include "plant/sensors.h"
#include "tests/plant/spectrum.h"

namespace imrig::plant {
namespace {

using namespace bench;

TEST(ChannelErrors, AddUpAsTheirEquationSays) {
  ChannelErrors e;
  EXPECT_TRUE(e.none());
  e.gain = {0.01, 0.0, -0.02}, e.offset = {0.1, 0.0, 0.2}, e.crosstalk = 0.01, e.cubic = -0.03,
  e.range = 40.0;
  double x[3] = {20.0, -10.0, -10.0};
  e.apply(x);
  const double bent = 10.0 * (1.0 - 0.03 / 16.0);
  EXPECT_NEAR(x[0], 1.01 * (20.0 * (1.0 - 0.03 / 4.0) - 0.02 * bent) + 0.1, 1e-12);
  EXPECT_NEAR(x[1], -bent + 0.01 * (20.0 * (1.0 - 0.03 / 4.0) - bent), 1e-12);
  EXPECT_NEAR(x[2], 0.98 * (-bent + 0.01 * (20.0 * (1.0 - 0.03 / 4.0) - bent)) + 0.2, 1e-12);
}

// A gain mismatch makes the negative sequence, an offset the direct current, a cubic the third harmonics.
TEST(CurrentSensors, PutTheirErrorsIntoTheLinesTheyAreKnownBy) {
  PlantConfig c = held_speed(1440.0);
  CurrentSensors::Config errors;
  errors.errors.gain = {0.02, 0.0, 0.0}, errors.errors.offset = {0.0, 0.3, 0.0};
  c.effects = {std::make_shared<CurrentSensors>(errors)};
  c.sensors.current_range_A = 40.0;
  Plant plant(c);
  const Supply supply{50.0, 150.0};
  run(plant, supply, 3.0);
  Line base(50.0, 60e-6, 16667), negative(-50.0, 60e-6, 16667), zero(0.0, 60e-6, 16667),
      truth(50.0, 60e-6, 16667);
  for (int k = 0; k < 16667; ++k) {
    const RawSample raw = plant.step(supply.at(plant));
    const Complex i = plant.scale().current_A_per_count * space_vector(raw.i[0], raw.i[1], raw.i[2]);
    base.add(i), negative.add(i), zero.add(i), truth.add(plant.state().i_s);
  }
  const double i = truth.amplitude();
  EXPECT_NEAR(base.amplitude(), i * (1.0 + 0.02 / 3.0), 1e-4 * i);
  EXPECT_NEAR(negative.amplitude(), i * 0.02 / 3.0, 1e-4 * i);
  EXPECT_NEAR(zero.amplitude(), 0.2, 1e-3);
}

TEST(CurrentSensors, LagAndDelayWithTheirTransferFunctions) {
  for (const double f_Hz : {50.0, 500.0}) {
    CurrentSensors::Config timing;
    timing.lag_s = 100e-6, timing.delay_s = 80e-6;
    PlantConfig c = held_speed(0.0);
    c.sample_time_ns = 10'000, c.pwm_time_ns = 240'000;
    c.effects = {std::make_shared<CurrentSensors>(timing)};
    c.sensors.current_range_A = 40.0;
    Plant plant(c);
    const Supply supply{f_Hz, f_Hz};
    run(plant, supply, 2.0);
    Complex seen = 0.0, truth = 0.0;
    for (int k = 0; k < 10000; ++k) {
      const RawSample raw = plant.step(supply.at(plant));
      const Complex turn = std::polar(1.0, -2.0 * kPi * f_Hz * 10e-6 * k);
      seen += turn * plant.scale().current_A_per_count * space_vector(raw.i[0], raw.i[1], raw.i[2]);
      truth += turn * plant.state().i_s;
    }
    const double w = 2.0 * kPi * f_Hz;
    const Complex expected = std::polar(1.0, -2.0 * std::atan(0.5 * w * 80e-6)) / (1.0 + kJ * w * 100e-6);
    EXPECT_NEAR(std::abs(seen / truth - expected), 0.0, 2e-4) << f_Hz;
    EXPECT_NEAR(2.0 * std::atan(0.5 * w * 80e-6), w * 80e-6, std::pow(w * 80e-6, 3) / 12.0);
  }
}

TEST(VoltageSensors, ShowTheOffsetWithoutAnyVoltage) {
  ChannelErrors errors;
  errors.offset = {2.0, -1.0, 0.0};
  PlantConfig c = config();
  c.effects = {std::make_shared<VoltageSensors>(errors)};
  Plant plant(c);
  const RawSample raw = plant.step({});
  EXPECT_NEAR(raw.v[0] * plant.scale().voltage_V_per_count, 2.0, 0.01);
  EXPECT_NEAR(raw.v[1] * plant.scale().voltage_V_per_count, -1.0, 0.01);
  EXPECT_EQ(raw.v[2], 0);
}

TEST(EncoderEccentricity, ReadsWrongOnceAndTwicePerTurn) {
  PlantConfig c = held_speed(600.0);
  c.sensors.encoder_counts_per_rev = 1 << 20;
  c.effects = {std::make_shared<EncoderEccentricity>(EncoderEccentricity::Config{0.01, 0.5, 0.004, 1.0})};
  Plant plant(c);
  double worst = 0.0;
  std::int32_t least = 0;
  for (int k = 1; k <= 10000; ++k) {
    const RawSample raw = plant.step({});
    const double theta = 2.0 * kPi * 10.0 * k * 60e-6, read = 2.0 * kPi * raw.encoder / (1 << 20);
    worst = std::max(
        worst, std::abs(read - theta - 0.01 * std::sin(theta + 0.5) - 0.004 * std::sin(2.0 * theta + 1.0)));
    least = std::min(least, raw.encoder);
  }
  EXPECT_LT(worst, 2.0 * 2.0 * kPi / (1 << 20));
  EXPECT_GE(least, 0);
}

TEST(Encoder, MissesCountsWithItsProbabilityAndTheSeedsBits) {
  const auto missed = [](std::uint64_t seed, double loss) {
    SensorsConfig c;
    c.ideal = true, c.encoder_loss = loss;
    Sensors sensors(c, seed);
    Measured values{};
    RawSample raw{};
    for (int k = 0; k <= 100000; ++k) {
      values.encoder_rad = 2.0 * kPi * ((k * 7 % 4096) + 0.5) / 4096.0;
      raw = sensors.sample(values, k * 7 / 4096);
    }
    return 700000 - raw.encoder;
  };
  EXPECT_EQ(missed(1, 0.0), 0);
  EXPECT_EQ(missed(1, 0.001), missed(1, 0.001));
  EXPECT_NE(missed(1, 0.001), missed(2, 0.001));
  EXPECT_NEAR(missed(1, 0.001), 700.0, 5.0 * std::sqrt(700.0));
  EXPECT_EQ(missed(3, 1.0), 700000);
}

// A winding temperature that jumps is read as an exponential.
class Jump : public Effect {
 public:
  std::string name() const override { return "jump"; }
  unsigned hooks() const override { return kTemperatures | kMeasured; }
  std::vector<Parameter> parameters() const override { return {}; }
  void temperatures(const Conditions&, const double*, Temperatures& t) const override { t.stator_C = 80.0; }
  void measured(const Conditions& at, const double*, Measured& values) const override {
    values.stator_C = at.temperature.stator_C;
  }
};

TEST(Thermocouple, LagsBehindTheWindingAndErrs) {
  PlantConfig c = config();
  c.effects = {std::make_shared<Jump>(),
               std::make_shared<Thermocouple>(Thermocouple::Config{0.3, 0.02, -1.0})};
  Plant plant(c);
  for (int k = 1; k <= 10000; ++k) {
    const double read = static_cast<double>(plant.step({}).stator_C);
    ASSERT_NEAR(read, 1.02 * (80.0 - 55.0 * std::exp(-k * 60e-6 / 0.3)) - 1.0, 1e-4) << k;
  }
}

TEST(Clock, ThatIsSlowTakesLongerStepsAndJitterMovesTheSamplesOnly) {
  PlantConfig c = held_speed(600.0);
  c.sensors.encoder_counts_per_rev = 1 << 20;
  c.sensors.clock_ppm = 1000.0, c.sensors.clock_jitter_s = 3e-6;
  Plant plant(c);
  double square = 0.0, mean = 0.0, most = 0.0;
  const int n = 20000;
  for (int k = 1; k <= n; ++k) {
    const RawSample raw = plant.step({});
    const double late = raw.encoder / (10.0 * (1 << 20)) - k * 60e-6 * 1.001;
    square += late * late / n, mean += late / n, most = std::max(most, std::abs(late));
  }
  EXPECT_NEAR(std::sqrt(square), 3e-6, 1e-7);
  EXPECT_NEAR(mean, 0.0, 1.5e-7);  // half a count is 5e-8 s
  EXPECT_LE(most, 15.1e-6);
}

TEST(TorqueTransducer, ShowsTheLoadWithItsGainAndOffset) {
  PlantConfig c = config();
  c.integrator.kind = IntegratorConfig::Kind::kRk4;
  c.sensors.torque_gain = 1.01, c.sensors.torque_offset_Nm = 0.2;
  Plant plant(c);
  plant.set_excitation({60.0, 1.2, true, 0.0, 0.0});
  run(plant, {50.0, 150.0, 0.2}, 3.0);
  EXPECT_GT(plant.state().load_Nm, 5.0);
  EXPECT_NEAR(plant.state().transducer_Nm, 1.01 * plant.state().load_Nm + 0.2, 1e-12);
}

}  // namespace
}  // namespace imrig::plant
