#include "estimators/online/r_r_observer/rotor_resistance.h"

#include <gtest/gtest.h>

#include <cmath>

#include "estimators/online/r_r_observer/rotor_tracker.h"
#include "tests/estimators/online/r_r_observer/phasor_motor.h"

namespace imrig::est {
namespace {

RotorResistance seen(const phasor::Motor& m, const RotorCircuit& known, double f_Hz, double slip) {
  const double w = 2.0 * M_PI * f_Hz;
  const auto z = phasor::impedance(m, w, slip);
  return rotor_resistance(known, std::abs(z), std::arg(z), w, slip);
}

const RotorCircuit kKnown{0.39, 0.068, 0.0, 0.22};

TEST(RotorResistance, IsThePhasorCircuitsOnBothSidesOfTheCornerMotoringAndGenerating) {
  for (const double R_r : {0.16, 0.22, 0.30}) {
    phasor::Motor m;
    m.R_r = R_r;
    for (const double f : {30.0, 60.0, 80.0}) {
      for (const double slip : {0.002, 0.004, 0.025, 0.04, 0.1, 1.0, -0.03, -0.1}) {
        const auto found = seen(m, kKnown, f, slip);
        const double corner = R_r / (2.0 * M_PI * f * m.L_m);
        if (std::abs(slip) / corner > 0.7 && std::abs(slip) / corner < 1.5) continue;  // next test
        ASSERT_EQ(found.status, RotorResistanceStatus::kValid) << f << " Hz, slip " << slip;
        EXPECT_NEAR(found.R_r_ohm / R_r, 1.0, 1e-9);
        EXPECT_EQ(found.upper_root, std::abs(slip) < corner);
      }
    }
  }
}

TEST(RotorResistance, NearTheCornerItIsNotGivenAtAll) {
  const double corner = 0.22 / (2.0 * M_PI * 60.0 * 0.068);
  EXPECT_NEAR(corner, 0.0086, 1e-4);
  const auto found = seen(phasor::Motor{}, kKnown, 60.0, 1.02 * corner);
  EXPECT_EQ(found.status, RotorResistanceStatus::kIllConditioned);
  EXPECT_TRUE(std::isnan(found.R_r_ohm));
}

// The derivative that the observer states, by difference.
TEST(RotorResistance, SensitivityIsTheDerivative) {
  const phasor::Motor m;
  const double w = 2.0 * M_PI * 60.0;
  const auto z = phasor::impedance(m, w, 0.03);
  const auto at = [&](double a_factor) {
    const double a = (z.real() - 0.39) * a_factor;
    return rotor_resistance(kKnown, 0.39 + a, 0.0, w, 0.03);
  };
  const double slope = std::log(at(1.0 + 1e-6).R_r_ohm / at(1.0 - 1e-6).R_r_ohm) / 2e-6;
  EXPECT_NEAR(at(1.0).sensitivity, std::abs(slope), 1e-4 * std::abs(slope));
}

TEST(RotorResistance, NoRealRootIsToldAndNeverClamped) {
  RotorCircuit wrong = kKnown;
  wrong.L_m_H = 0.03;  // 2 a > X at this slip
  const auto found = seen(phasor::Motor{}, wrong, 60.0, 0.0093);
  EXPECT_EQ(found.status, RotorResistanceStatus::kNotReal);
  EXPECT_TRUE(std::isnan(found.R_r_ohm));
}

TEST(RotorResistance, PowerAgainstTheSlipIsNoRotorsDoing) {
  const double w = 2.0 * M_PI * 60.0;
  EXPECT_EQ(rotor_resistance(kKnown, 5.0, 0.5, w, -0.03).status, RotorResistanceStatus::kNoPower);
  EXPECT_EQ(rotor_resistance(kKnown, 0.39, 0.0, w, 0.03).status, RotorResistanceStatus::kNoPower);
}

TEST(RotorResistance, CoreLossIsTakenOffExactlyWhereTheModelHasIt) {
  phasor::Motor m;
  m.R_c = 150.0;
  RotorCircuit known = kKnown;
  for (const double slip : {0.025, 0.05, -0.04}) {
    const double without = seen(m, known, 60.0, slip).R_r_ohm;
    RotorCircuit with = known;
    with.R_c_ohm = 150.0;
    EXPECT_GT(std::abs(without / 0.22 - 1.0), 0.02) << slip;
    EXPECT_NEAR(seen(m, with, 60.0, slip).R_r_ohm / 0.22, 1.0, 1e-9) << slip;
  }
}

TEST(RotorTracker, TellsTheResistanceAtAnotherSlip) {
  RotorTracker tracker(0.0007);
  EXPECT_FALSE(tracker.R_r_ohm(10.0));
  tracker.take(0.22 + 0.0007 * 12.0, -12.0, 0.2);
  EXPECT_NEAR(*tracker.R_1_ohm(), 0.22, 1e-12);
  EXPECT_NEAR(*tracker.R_r_ohm(377.0), 0.22 + 0.0007 * 377.0, 1e-12);
}

TEST(RotorTracker, SettlesWithItsTimeConstant) {
  RotorTracker tracker(0.0, 5.0);
  tracker.take(0.20, 10.0, 0.2);
  for (int k = 0; k < 25; ++k) tracker.take(0.25, 10.0, 0.2);
  EXPECT_NEAR(*tracker.R_1_ohm(), 0.25 - 0.05 * std::exp(-1.0), 1e-9);
}

}  // namespace
}  // namespace imrig::est
