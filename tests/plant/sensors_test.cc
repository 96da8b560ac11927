#include "plant/sensors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "plant/voltage_filter.h"
#include "tests/plant/bench.h"

namespace imrig::plant {
namespace {

using namespace bench;

Measured values(double i_a, double v_a, double angle_rad = 0.0) {
  return {{i_a, 0.0, 0.0}, {v_a, 0.0, 0.0}, angle_rad, 25.0};
}

SensorsConfig plain_12_bit() {
  SensorsConfig c;
  c.current_noise_A = c.voltage_noise_V = c.gain_sigma = c.offset_sigma_counts = 0.0;
  return c;
}

TEST(Converter, CutsTheRangeIntoItsCounts) {
  Sensors sensors(plain_12_bit(), 1);
  EXPECT_EQ(sensors.scale().full_scale_counts, 2048);
  EXPECT_DOUBLE_EQ(sensors.scale().current_A_per_count, 40.0 / 2048.0);
  EXPECT_DOUBLE_EQ(sensors.scale().voltage_V_per_count, 400.0 / 2048.0);
  for (double i = -39.9; i < 39.9; i += 0.37) {
    const RawSample raw = sensors.sample(values(i, 10.0 * i), 0);
    EXPECT_LE(std::abs(raw.i[0] * 40.0 / 2048.0 - i), 0.5 * 40.0 / 2048.0 + 1e-12);
    EXPECT_LE(std::abs(raw.v[0] * 400.0 / 2048.0 - 10.0 * i), 0.5 * 400.0 / 2048.0 + 1e-12);
  }
}

TEST(Converter, ClipsAtItsRange) {
  Sensors sensors(plain_12_bit(), 1);
  EXPECT_EQ(sensors.sample(values(100.0, 1e6), 0).i[0], 2047);
  EXPECT_EQ(sensors.sample(values(100.0, 1e6), 0).v[0], 2047);
  EXPECT_EQ(sensors.sample(values(-100.0, -1e6), 0).i[0], -2048);
  EXPECT_EQ(sensors.sample(values(-100.0, -1e6), 0).v[0], -2048);
}

TEST(Converter, HasSixteenBitsWhereTheSensorsAreIdeal) {
  SensorsConfig c;
  c.ideal = true;
  Sensors sensors(c, 1);
  EXPECT_EQ(sensors.scale().full_scale_counts, 32768);
  EXPECT_EQ(sensors.sample(values(100.0, -1e6), 0).i[0], 32767);
  EXPECT_NEAR(sensors.sample(values(10.0, 100.0), 0).i[0] * sensors.scale().current_A_per_count, 10.0,
              0.0007);
}

TEST(Sensors, AddNoiseOffsetAndGainOfTheStatedSize) {
  SensorsConfig c;
  Sensors sensors(c, 7);
  const SensorErrors errors = draw_sensor_errors(c, 7);
  const int n = 200000;
  double sum = 0.0, square = 0.0, lag = 0.0, last = 0.0;
  for (int k = 0; k < n; ++k) {
    const double counts = sensors.sample(values(20.0, 0.0), 0).i[0];
    const double error =
        counts - (20.0 * (1.0 + errors.current_gain[0]) / sensors.scale().current_A_per_count +
                  errors.current_offset_counts[0]);
    sum += error, square += error * error, lag += error * last;
    last = error;
  }
  const double noise_counts = c.current_noise_A / sensors.scale().current_A_per_count;
  EXPECT_NEAR(sum / n, 0.0, 0.02);
  EXPECT_NEAR(square / n, noise_counts * noise_counts + 1.0 / 12.0, 0.04);  // quantization adds a twelfth
  EXPECT_NEAR(lag / square, 0.0, 0.01);
}

TEST(Sensors, DrawGainsAndOffsetsWithTheConfiguredSpread) {
  SensorsConfig c;
  double gain2 = 0.0, offset2 = 0.0;
  const int seeds = 3000;
  for (int seed = 0; seed < seeds; ++seed) {
    const SensorErrors e = draw_sensor_errors(c, static_cast<std::uint64_t>(seed));
    for (std::size_t k = 0; k < 3; ++k) {
      gain2 +=
          (e.current_gain[k] * e.current_gain[k] + e.voltage_gain[k] * e.voltage_gain[k]) / (6.0 * seeds);
      offset2 += (e.current_offset_counts[k] * e.current_offset_counts[k] +
                  e.voltage_offset_counts[k] * e.voltage_offset_counts[k]) /
                 (6.0 * seeds);
    }
  }
  EXPECT_NEAR(std::sqrt(gain2), 0.001, 2e-5);
  EXPECT_NEAR(std::sqrt(offset2), 3.0, 0.06);
}

TEST(Noise, IsNormal) {
  Noise noise(3);
  const int n = 400000;
  double m1 = 0.0, m2 = 0.0, m4 = 0.0;
  int beyond_2 = 0;
  for (int k = 0; k < n; ++k) {
    const double x = noise.normal();
    m1 += x / n, m2 += x * x / n, m4 += x * x * x * x / n;
    beyond_2 += std::abs(x) > 2.0;
  }
  EXPECT_NEAR(m1, 0.0, 0.008);
  EXPECT_NEAR(m2, 1.0, 0.012);
  EXPECT_NEAR(m4, 3.0, 0.08);
  EXPECT_NEAR(static_cast<double>(beyond_2) / n, std::erfc(2.0 / std::sqrt(2.0)), 0.0015);
}

// Pearson's test on 500 cells of equal probability, and what lies beyond the ziggurat's base (R = 3.654): how much,
// how far out on the average (the inverse Mills ratio), both signs.
TEST(Noise, HasTheNormalDistributionInEveryCellAndInTheTail) {
  constexpr int kCells = 500, kDraws = 4'000'000;
  constexpr double kBase = 3.6541528853610088;
  Noise noise(11);
  std::vector<int> cells(kCells);
  int beyond = 0, positive = 0;
  double excess = 0.0, lag = 0.0, last = 0.0;
  for (int k = 0; k < kDraws; ++k) {
    const double x = noise.normal(), below = 0.5 * std::erfc(-x / std::sqrt(2.0));
    ++cells[static_cast<std::size_t>(std::min(kCells - 1.0, below * kCells))];
    if (std::abs(x) > kBase) ++beyond, excess += std::abs(x), positive += x > 0.0;
    lag += x * last, last = x;
  }
  double chi2 = 0.0;
  const double expected = static_cast<double>(kDraws) / kCells;
  for (const int n : cells) chi2 += (n - expected) * (n - expected) / expected;
  EXPECT_NEAR(chi2, kCells - 1.0, 4.0 * std::sqrt(2.0 * (kCells - 1.0)));
  const double tail = std::erfc(kBase / std::sqrt(2.0));
  const double mean = std::sqrt(2.0 / kPi) * std::exp(-0.5 * kBase * kBase) / tail;
  EXPECT_NEAR(beyond, tail * kDraws, 4.0 * std::sqrt(tail * kDraws));
  EXPECT_NEAR(excess / beyond, mean, 4.0 * 0.25 / std::sqrt(beyond));
  EXPECT_NEAR(positive, 0.5 * beyond, 2.0 * std::sqrt(beyond));
  EXPECT_NEAR(lag / kDraws, 0.0, 4.0 / std::sqrt(kDraws));
}

TEST(Noise, IsDecidedByItsSeed) {
  Noise a(5), b(5), c(6);
  bool differs = false;
  for (int k = 0; k < 1000; ++k) {
    const double x = a.normal();
    EXPECT_EQ(x, b.normal());
    differs = differs || x != c.normal();
  }
  EXPECT_TRUE(differs);
}

TEST(Encoder, CountsLinesOverTurnsAndWraps) {
  Sensors sensors(plain_12_bit(), 1);
  const double line = 2.0 * kPi / 4096.0;
  EXPECT_EQ(sensors.sample(values(0, 0, 0.0), 0).encoder, 0);
  EXPECT_EQ(sensors.sample(values(0, 0, 0.999 * line), 0).encoder, 0);
  EXPECT_EQ(sensors.sample(values(0, 0, 1.001 * line), 0).encoder, 1);
  EXPECT_EQ(sensors.sample(values(0, 0, 2.0 * kPi - 0.5 * line), -1).encoder, -1);
  EXPECT_EQ(sensors.sample(values(0, 0, 100.5 * line), 12).encoder, 12 * 4096 + 100);
  // 2^31 lines are 524288 turns: one more turn wraps.
  EXPECT_EQ(sensors.sample(values(0, 0, 0.0), 524288).encoder, std::numeric_limits<std::int32_t>::min());
  EXPECT_EQ(sensors.sample(values(0, 0, 3.5 * line), 1048576).encoder, 3);
}

TEST(Encoder, FollowsTheShaftInBothDirections) {
  for (const double direction : {1.0, -1.0}) {
    Plant plant(config());
    std::int64_t most = 0;
    RawSample raw{};
    for (int k = 0; k < 30000; ++k) {
      const double t = (k + 0.5) * 60e-6;
      raw = plant.step(command(std::polar(100.0 * std::min(1.0, t), direction * 2.0 * kPi * 30.0 * t)));
      const Observed& now = plant.state();
      const double turns = static_cast<double>(now.turns) + now.angle_rad / (2.0 * kPi);
      ASSERT_LE(raw.encoder, turns * 4096.0 + 1e-6) << k;
      ASSERT_GT(raw.encoder + 1, turns * 4096.0 - 1e-6) << k;
      most = std::max<std::int64_t>(most, std::abs(now.turns));
    }
    EXPECT_GT(most, 10);
    EXPECT_GT(direction * raw.encoder, 10 * 4096);
  }
}

TEST(VoltageFilter, RisesExponentiallyUnderAHeldVoltage) {
  const double tau = 160e-6, h = 60e-6;
  PlantConfig c = config();
  Plant plant(c);
  for (int k = 1; k <= 30; ++k) {
    const RawSample raw = plant.step(command(90.0));
    ASSERT_NEAR(raw.v[0] * plant.scale().voltage_V_per_count, 90.0 * (1.0 - std::exp(-k * h / tau)),
                0.51 * plant.scale().voltage_V_per_count);
  }
}

TEST(VoltageFilter, HasTheFrequencyResponseOfAFirstOrderLag) {
  const double tau = 160e-6, h = 1e-6;
  for (const double f_Hz : {60.0, 1000.0, 5000.0}) {
    VoltageFilter filter(tau);
    const double w = 2.0 * kPi * f_Hz;
    const int n = static_cast<int>(std::lround(20.0 / (f_Hz * h)));
    const auto input = [&](double t) { return std::polar(1.0, w * t); };
    for (int k = 0; k < n; ++k) filter.advance(input(k * h), input((k + 1) * h), h);
    const Complex expected = input(n * h) / Complex(1.0, w * tau);
    EXPECT_LT(std::abs(filter.output() - expected), 1e-4) << f_Hz;
  }
}

TEST(VoltageFilter, GivesTheSameHoweverAStraightStretchIsCut) {
  VoltageFilter whole(160e-6), cut(160e-6);
  const Complex u_0{10.0, -3.0}, u_1{-20.0, 8.0};
  whole.advance(u_0, u_1, 60e-6);
  cut.advance(u_0, u_0 + (u_1 - u_0) * 0.25, 15e-6);
  cut.advance(u_0 + (u_1 - u_0) * 0.25, u_1, 45e-6);
  EXPECT_LT(std::abs(whole.output() - cut.output()), 1e-12);
}

TEST(VoltageFilter, PassesEverythingWithoutATimeConstant) {
  VoltageFilter filter(0.0);
  filter.advance(1.0, 2.0, 1e-5);
  EXPECT_EQ(filter.output(), Complex(2.0));
}

TEST(Sensors, ReadTheDecayingBackEmfWithGatesOff) {
  Plant plant(config());
  run(plant, {60.0, 179.6, 0.1}, 1.5);
  hold(plant, {}, 0.02);
  const double w = kPolePairs * plant.state().w_mech_rad_s;
  const RawSample raw = plant.step({});
  const Complex seen = plant.scale().voltage_V_per_count * space_vector(raw.v[0], raw.v[1], raw.v[2]);
  const Complex expected = plant.state().v_s / Complex(1.0, w * plant.scale().voltage_filter_s);
  EXPECT_LT(std::abs(seen - expected), 0.005 * std::abs(expected));
}

std::vector<std::int32_t> bits(std::uint64_t seed) {
  PlantConfig c = config();
  c.sensors = SensorsConfig{};
  c.seed = seed;
  Plant plant(c);
  plant.set_excitation({60.0, 1.0, true, 0.0, 0.0});
  std::vector<std::int32_t> all;
  for (int k = 0; k < 6000; ++k) {
    const RawSample raw = k % 3000 < 2500 ? plant.step(Supply{60.0, 150.0}.at(plant)) : plant.step({});
    for (const auto* channels : {raw.i, raw.v}) all.insert(all.end(), channels, channels + 3);
    all.push_back(raw.encoder);
  }
  return all;
}

TEST(Plant, GivesTheSameBitsForTheSameSeed) {
  const auto first = bits(11);
  EXPECT_EQ(first, bits(11));
  EXPECT_NE(first, bits(12));
}

}  // namespace
}  // namespace imrig::plant
