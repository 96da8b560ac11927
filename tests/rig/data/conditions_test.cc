#include "rig/data/conditions.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace imrig {
namespace {

std::vector<SpaceVector> turning(double f_Hz, double dt, std::size_t n, double noise = 0.0) {
  std::mt19937 random(11);
  std::normal_distribution<double> error(0.0, 1.0);
  std::vector<SpaceVector> x(n);
  for (std::size_t k = 0; k < n; ++k) {
    x[k] = std::polar(100.0, 2.0 * kPi * f_Hz * dt * static_cast<double>(k) + 0.4) +
           noise * SpaceVector(error(random), error(random));
  }
  return x;
}

TEST(Conditions, FrequencyIsFoundToAHundredthOfAPerCentWithSign) {
  for (const double f : {50.0, -50.0, 30.0, 80.0, 12.5}) {
    EXPECT_NEAR(fundamental_of(turning(f, 60e-6, 5000), 60e-6).f_Hz, f, std::abs(f) * 1e-6);
    const auto noisy = fundamental_of(turning(f, 60e-6, 5000, 5.0), 60e-6);
    EXPECT_NEAR(noisy.f_Hz, f, std::abs(f) * 1e-3);
    EXPECT_NEAR(std::arg(noisy.amplitude), 0.4, 0.02);
    EXPECT_GT(noisy.share, 0.99);
  }
}

TEST(Conditions, NoiseAndMixturesHaveNoSingleFrequency) {
  std::mt19937 random(5);
  std::normal_distribution<double> error(0.0, 1.0);
  std::vector<SpaceVector> x(4000);
  for (auto& value : x) value = {error(random), error(random)};
  EXPECT_TRUE(std::isnan(fundamental_of(x, 1e-4).f_Hz));
  EXPECT_TRUE(std::isnan(fundamental_of(std::vector<SpaceVector>(100), 1e-4).f_Hz));
}

// A machine of known flux and torque: v and i follow from psi by construction.
TEST(Conditions, FluxTorqueAndSlipOfAKnownMachine) {
  const double w = 2.0 * kPi * 50.0, R_s = 0.4, dt = 60e-6;
  const SpaceVector psi0 = std::polar(0.9, 0.2), i0 = std::polar(12.0, 1.1);
  Record record;
  record.kind = RecordKind::kSteady;
  record.series.sample_time_s = dt;
  for (int k = 0; k < 5000; ++k) {
    const SpaceVector turn = std::polar(1.0, w * dt * k);
    record.series.v.push_back((R_s * i0 + SpaceVector(0.0, w) * psi0) * turn);
    record.series.i.push_back(i0 * turn);
    record.series.speed_rad_s.push_back(w / 2.0 * 0.97);
  }
  const Conditions c = conditions_of(record, 2, R_s);
  EXPECT_NEAR(c.f_Hz, 50.0, 1e-4);
  EXPECT_NEAR(c.slip, 0.03, 1e-5);
  EXPECT_NEAR(c.psi_Wb, 0.9, 1e-4);
  EXPECT_NEAR(c.torque_Nm, 1.5 * 2 * 0.9 * 12.0 * std::sin(0.9), 1e-2);
  EXPECT_NEAR(c.i_A, 12.0, 1e-9);
  EXPECT_TRUE(std::isnan(c.stator_C));
  EXPECT_TRUE(std::isnan(conditions_of(record, 2).psi_Wb)) << "no flux without a stator resistance";
}

TEST(Conditions, APointsCurrentLags) {
  SteadyPoint p;
  p.v_peak_V = 325.0;
  p.f_Hz = 50.0;
  p.i_peak_A = 10.0;
  p.p_in_W = 1.5 * 325.0 * 10.0 * 0.8;
  p.speed_rad_s = rad_s_of_rpm(1455.0);
  const Conditions c = conditions_of(p, 2, 0.5);
  const double air_gap_W = p.p_in_W - 1.5 * 0.5 * 100.0;
  EXPECT_NEAR(c.torque_Nm, air_gap_W / (2.0 * kPi * 50.0 / 2), 1e-9);
  EXPECT_NEAR(c.slip, 0.03, 1e-12);
}

TEST(Conditions, DcResistanceIsTheMeanOverDcRecords) {
  DataSet data;
  for (const double R : {0.40, 0.42}) {
    Record record;
    record.kind = RecordKind::kDc;
    record.series.v.assign(50, SpaceVector(R * 5.0, 0.0));
    record.series.i.assign(50, SpaceVector(5.0, 0.0));
    data.records.push_back(record);
  }
  EXPECT_NEAR(dc_resistance_ohm(data), 0.41, 1e-12);
  EXPECT_TRUE(std::isnan(dc_resistance_ohm(DataSet{})));
}

}  // namespace
}  // namespace imrig
