// Noise that was made here, white or coloured, is found again; what was declared is believed where it can be.

#include "estimators/fit/global/noise_levels.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "rig/base/space_vector.h"

namespace imrig::est {
namespace {

struct Made {
  double current_A = 0.05, voltage_V = 0.2;
  double pole = 0.0;  // from one sample to the next
  double ripple_V = 0.0;
  double harmonics = 0.0;  // of the 5th, two thirds of it of the 7th; of the voltage, and less of the current
  double sample_time_s = 1e-4;
};

// Unit variance a component; x[k+1] = pole x[k] + fresh noise.
class Coloured {
 public:
  Coloured(double pole, unsigned seed) : pole_(pole), random_(seed) {}
  SpaceVector next() {
    const double a = normal_(random_), b = normal_(random_);
    state_ = pole_ * state_ + std::sqrt(1.0 - pole_ * pole_) * SpaceVector(a, b);
    return state_;
  }

 private:
  double pole_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  SpaceVector state_;
};

Record record(const Made& made, RecordKind kind, double f_Hz, unsigned seed) {
  Record out;
  out.kind = kind;
  TimeSeries& s = out.series;
  s.sample_time_s = made.sample_time_s;
  Coloured i(made.pole, seed), v(made.pole, seed + 1000);
  for (int k = 0; k < 5000; ++k) {
    const double t = s.sample_time_s * k;
    const SpaceVector turn = std::polar(1.0, 2.0 * kPi * f_Hz * t);
    const double w5 = -2.0 * kPi * 5.0 * f_Hz, w7 = 2.0 * kPi * 7.0 * f_Hz;
    const SpaceVector distortion =
        f_Hz > 0.0 ? made.harmonics * (std::polar(1.0, w5 * t) + std::polar(2.0 / 3.0, w7 * t)) : 0.0;
    s.i.push_back(5.0 * (turn + distortion) + made.current_A * i.next());
    s.v.push_back(100.0 * (turn + distortion) + made.voltage_V * v.next() +
                  made.ripple_V * std::cos(2.0 * kPi * 1500.0 * t));
    s.speed_rad_s.push_back(2.0 * kPi * f_Hz / 2.0);
  }
  return out;
}

DataSet data(const Made& made, const Noise& declared) {
  DataSet out;
  out.pole_pairs = 2;
  out.noise = declared;
  for (unsigned n = 0; n < 4; ++n) out.records.push_back(record(made, RecordKind::kStep, 50.0, 10 * n));
  for (unsigned n = 4; n < 6; ++n) out.records.push_back(record(made, RecordKind::kDc, 0.0, 10 * n));
  return out;
}

Noise declared(double current_A, double voltage_V) { return {current_A, voltage_V, 0.01, kMissing, kMissing}; }

TEST(NoiseLevels, AreSeenWhereNothingIsDeclared) {
  const NoiseEstimate n = noise_levels(data({}, {}));
  EXPECT_FALSE(n.declared);
  EXPECT_NEAR(n.levels.current_A, 0.05, 0.0025);
  EXPECT_NEAR(n.levels.voltage_V, 0.2, 0.01);
  EXPECT_EQ(n.colour, 1.0);
}

TEST(NoiseLevels, AreThoseDeclaredWhereTheDataAgree) {
  const NoiseEstimate n = noise_levels(data({}, declared(0.051, 0.19)));
  EXPECT_EQ(n.levels.current_A, 0.051);
  EXPECT_EQ(n.levels.voltage_V, 0.19);
}

TEST(NoiseLevels, AreThoseSeenWhereHalfOrTwiceWasDeclared) {
  for (const double wrong : {0.5, 2.0}) {
    const NoiseEstimate n = noise_levels(data({}, declared(0.05 * wrong, 0.2 * wrong)));
    EXPECT_NEAR(n.declared_factor, 1.0 / wrong, 0.05 / wrong);
    EXPECT_NEAR(n.levels.current_A, 0.05, 0.0025) << wrong;
    EXPECT_NEAR(n.levels.voltage_V, 0.2, 0.01) << wrong;
  }
}

// Filtered data look quiet from sample to sample though they are not.
TEST(NoiseLevels, AreNotBelievedToBeLessThanDeclaredWithoutAConstantCurrent) {
  DataSet moving = data({}, declared(0.1, 0.4));
  moving.records.resize(4);
  const NoiseEstimate n = noise_levels(moving);
  EXPECT_EQ(n.levels.current_A, 0.1);
  EXPECT_EQ(n.levels.voltage_V, 0.4);
  EXPECT_EQ(n.declared_factor, 1.0);
}

TEST(NoiseLevels, AreThoseDeclaredWhereThereAreSteadyPointsOnly) {
  DataSet table;
  table.pole_pairs = 2;
  table.noise = declared(0.1, 0.4);
  const NoiseEstimate n = noise_levels(table);
  EXPECT_EQ(n.levels.current_A, 0.1);
  EXPECT_EQ(n.declared_factor, 1.0);
}

TEST(NoiseLevels, DoNotTakeASupplysRippleForNoiseOfTheVoltageSensor) {
  Made made;
  made.ripple_V = 3.0;
  const NoiseEstimate n = noise_levels(data(made, declared(0.05, 0.2)));
  EXPECT_GT(n.seen.voltage_V, 0.4);
  EXPECT_EQ(n.levels.voltage_V, 0.2);
}

// Smooth, but at 2.5 kHz two samples of a 7th harmonic are an eighth of its period apart.
TEST(NoiseLevels, AreNotThoseOfASupplysHarmonics) {
  for (const double sample_time_s : {5e-5, 1e-4, 4e-4}) {
    Made made;
    made.harmonics = 0.03;
    made.sample_time_s = sample_time_s;
    const NoiseEstimate n = noise_levels(data(made, {}));
    EXPECT_NEAR(n.seen.current_A, 0.05, 0.004) << sample_time_s;
    EXPECT_NEAR(n.seen.voltage_V, 0.2, 0.016) << sample_time_s;
  }
}

// Averages of m samples of x[k+1] = a x[k] + fresh keep (1 + a)/(1 - a) of white noise's variance for many samples; of
// five, 1 + 2 sum (1 - n/5) a^n.
TEST(NoiseLevels, KnowWhatAveragesKeepOfColouredNoise) {
  Made made;
  made.pole = 0.6;
  double kept = 1.0;
  for (int n = 1; n < 5; ++n) kept += 2.0 * (1.0 - n / 5.0) * std::pow(made.pole, n);
  const NoiseEstimate n = noise_levels(data(made, declared(0.05, 0.2)));
  EXPECT_NEAR(n.levels.current_A, 0.05 * std::sqrt(kept), 0.05 * 0.05 * std::sqrt(kept));
  EXPECT_NEAR(n.levels.voltage_V, 0.2 * std::sqrt(kept), 0.05 * 0.2 * std::sqrt(kept));
  EXPECT_GT(n.colour, 1.5);
}

}  // namespace
}  // namespace imrig::est
