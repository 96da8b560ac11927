// Faults against the sequence components and sidebands of their linear circuits.

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <memory>
#include <vector>

#include "plant/effects/broken_bar.h"
#include "plant/effects/stator_unbalance.h"
#include "plant/effects/supply_unbalance.h"
#include "tests/plant/spectrum.h"

namespace imrig::plant {
namespace {

using namespace bench;

constexpr double kF = 50.0, kW = 2.0 * kPi * kF, kSlip = 0.04, kRpm = 1500.0 * (1.0 - kSlip);
constexpr Supply kLine{kF, 150.0};
constexpr int kWindow = 16667;  // 1 s less 3e-5: within a line's width

struct Found {
  double base, below, negative, torque_2sf, volts;
};

Found spectrum(const std::shared_ptr<const Effect>& effect) {
  PlantConfig c = held_speed(kRpm);
  if (effect) c.effects = {effect};
  Plant plant(c);
  run(plant, kLine, 4.0);
  const double h = sample_s(plant);
  Line base(kF, h, kWindow), below(kF * (1.0 - 2.0 * kSlip), h, kWindow), negative(-kF, h, kWindow),
      torque(2.0 * kSlip * kF, h, kWindow);
  for (int k = 0; k < kWindow; ++k) {
    plant.step(kLine.at(plant));
    const Observed& now = plant.state();
    base.add(now.i_s), below.add(now.i_s), negative.add(now.i_s), torque.add(now.torque_Nm);
  }
  return {base.amplitude(), below.amplitude(), negative.amplitude(), 2.0 * torque.amplitude(),
          kLine.fundamental_V(plant)};
}

TEST(FaultEffects, ShowNoLineInAHealthyMotor) {
  const Found healthy = spectrum(nullptr);
  EXPECT_NEAR(healthy.base, healthy.volts / std::abs(motor_impedance(kRs, kW, kSlip)), 1e-4 * healthy.base);
  EXPECT_LT(healthy.below, 1e-5 * healthy.base);
  EXPECT_LT(healthy.negative, 1e-5 * healthy.base);
  EXPECT_LT(healthy.torque_2sf, 1e-4);
}

TEST(BrokenBar, PutsTheLowerSidebandAndTheTorqueRippleWhereItsCircuitHasThem) {
  const BrokenBar bar({2.0, 28.0});
  const Found found = spectrum(std::make_shared<BrokenBar>(bar));
  // Rotor currents at +s and -s of the slip frequency, coupled by the asymmetry; the stator's line at (1-2s)f
  // is shorted by the stiff supply.
  const double k = bar.asymmetry(), w_2 = (1.0 - 2.0 * kSlip) * kW, ws = kSlip * kW;
  EXPECT_NEAR(k, 2.0 / 22.0, 1e-15);
  const Complex Z_1 = kRs + kJ * kW * kL, Z_2 = kRs + kJ * w_2 * kL;
  const Complex L_1 = kL - kJ * kW * kM * kM / Z_1, L_2 = kL - kJ * w_2 * kM * kM / Z_2;
  const Complex a = kRrT * (1.0 + k) + kJ * ws * L_1, d = kRrT * (1.0 + k) + kJ * ws * std::conj(L_2);
  const double b = kRrT * k;
  const Complex drive = -kJ * ws * kM * found.volts / Z_1;
  const Complex I_1 = drive * d / (a * d - b * b), I_2 = std::conj(-b * I_1 / d);
  const Complex psi_1 = kM * found.volts / Z_1 + L_1 * I_1, psi_2 = L_2 * I_2;
  const double line = std::abs(kW * (1.0 - 2.0 * kSlip) * kM * I_2 / Z_2);
  const double torque = 1.5 * kPolePairs * std::abs(std::conj(psi_2) * I_1 - psi_1 * std::conj(I_2));
  std::printf("2 of 28 bars: (1-2s)f %.4f of the fundamental, torque at 2sf %.3f Nm\n",
              found.below / found.base, found.torque_2sf);
  EXPECT_GT(found.below, 0.01 * found.base);
  EXPECT_NEAR(found.below, line, 2e-3 * line);
  EXPECT_NEAR(found.torque_2sf, torque, 2e-3 * torque);
}

TEST(BrokenBar, LetsTheSpeedAnswerWithTheUpperSideband) {
  const auto sidebands = [](double broken) {
    PlantConfig c = config();
    c.integrator.kind = IntegratorConfig::Kind::kRk4;
    c.effects = {std::make_shared<BrokenBar>(BrokenBar::Config{broken, 28.0})};
    Plant plant(c);
    plant.set_excitation({60.0, 2.0, true, 0.0, 0.0});
    run(plant, {kF, 150.0, 0.2}, 8.0);
    const int n = 4 * kWindow;
    double speed = 0.0;
    std::vector<Complex> i;
    for (int k = 0; k < n; ++k) {
      plant.step(kLine.at(plant));
      i.push_back(plant.state().i_s);
      speed += plant.state().speed_rpm / n;
    }
    const double slip = 1.0 - speed / 1500.0, h = sample_s(plant);
    Line base(kF, h, n), below(kF * (1.0 - 2.0 * slip), h, n), above(kF * (1.0 + 2.0 * slip), h, n);
    for (const Complex x : i) base.add(x), below.add(x), above.add(x);
    EXPECT_GT(slip, 0.015);
    return std::array{below.amplitude() / base.amplitude(), above.amplitude() / base.amplitude()};
  };
  const auto healthy = sidebands(0.0), broken = sidebands(2.0);
  std::printf("free shaft: (1-2s)f %.4f, (1+2s)f %.4f of the fundamental; healthy %.1e, %.1e\n", broken[0],
              broken[1], healthy[0], healthy[1]);
  for (const std::size_t side : {0u, 1u}) {
    EXPECT_LT(healthy[side], 2e-4);
    EXPECT_GT(broken[side], 3e-3);
  }
}

TEST(SupplyUnbalance, DrawsItsNegativeSequenceThroughTheImpedanceAtSlipTwoMinusS) {
  const double g[3] = {0.02, 0.0, -0.01};
  const Found found = spectrum(std::make_shared<SupplyUnbalance>(SupplyUnbalance::Config{g[0], g[1], g[2]}));
  const Complex a = std::polar(1.0, 2.0 * kPi / 3.0);
  const double share = std::abs(g[0] + a * a * g[1] + a * g[2]) / 3.0;
  EXPECT_NEAR(found.negative, share * found.volts / std::abs(motor_impedance(kRs, kW, 2.0 - kSlip)),
              1e-3 * found.negative);
  EXPECT_NEAR(found.base, (1.0 + 0.01 / 3.0) * found.volts / std::abs(motor_impedance(kRs, kW, kSlip)),
              1e-4 * found.base);
  EXPECT_GT(found.negative, 0.3);
}

TEST(StatorUnbalance, DrawsTheNegativeSequenceOfItsDiagonalImpedance) {
  const double r[3] = {0.5, 0.0, 0.1};
  const Found found = spectrum(std::make_shared<StatorUnbalance>(StatorUnbalance::Config{r[0], r[1], r[2]}));
  const Complex a = std::polar(1.0, 2.0 * kPi / 3.0);
  const double R_0 = kRs * (1.0 + 0.2);
  const Complex R_c = kRs * (r[0] + a * a * r[1] + a * r[2]) / 3.0;
  const Complex Z_1 = motor_impedance(R_0, kW, kSlip), Z_2 = motor_impedance(R_0, kW, 2.0 - kSlip);
  const double base = std::abs(found.volts / (Z_1 - std::norm(R_c) / Z_2));
  EXPECT_NEAR(found.base, base, 1e-4 * base);
  EXPECT_NEAR(found.negative, std::abs(R_c) * base / std::abs(Z_2), 1e-3 * found.negative);
  EXPECT_GT(found.negative, 0.1);
}

// With DC each phase shows its own resistance.
TEST(StatorUnbalance, IsEachPhasesOwnResistanceUnderDirectCurrent) {
  PlantConfig c = held_speed(0.0);
  c.effects = {std::make_shared<StatorUnbalance>(StatorUnbalance::Config{0.5, 0.0, 0.0})};
  Plant plant(c);
  hold(plant, command(4.0), 8.0);
  // Phase a with 1.5 R_s in series with b and c in parallel: of u_a - u_b = 6 V.
  EXPECT_NEAR(plant.state().i_s.real(), 6.0 / (2.0 * kRs), 1e-3);
}

}  // namespace
}  // namespace imrig::plant
