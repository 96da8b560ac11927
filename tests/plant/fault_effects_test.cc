// Faults against the sequence components and sidebands of their linear circuits.

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <memory>
#include <vector>

#include "plant/effects/broken_bar.h"
#include "plant/effects/shorted_turns.h"
#include "plant/effects/stator_unbalance.h"
#include "plant/effects/supply_unbalance.h"
#include "plant/powers.h"
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

// The winding coil by coil, as phasors: phase a in two parts of which the second is closed by R_f, phases b
// and c whole, star point free. Each coil has its turns' share of resistance and leakage and sees the air
// gap, which answers each sequence of the ampere-turns with rotor and magnetizing inductance.
struct CoilByCoil {
  Complex positive, negative, fault;
  double copper_W;
};

CoilByCoil coil_by_coil(double mu, double R_f, double V) {
  const double L_ls = kL - kM;
  const Complex Z_p = motor_impedance(0.0, kW, kSlip) - kJ * kW * L_ls;
  const Complex Z_n = motor_impedance(0.0, kW, 2.0 - kSlip) - kJ * kW * L_ls;
  const Complex turn = std::polar(1.0, 2.0 * kPi / 3.0), z = kRs + kJ * kW * L_ls;
  const double share[4] = {1.0 - mu, mu, 1.0, 1.0};  // coils a1, a2, b, c
  const Complex axis[4] = {1.0, 1.0, turn, turn * turn};
  // Coil currents from the unknowns i_a, i_b, i_c, i_f.
  const double from[4][4] = {{1, 0, 0, 0}, {1, 0, 0, -1}, {0, 1, 0, 0}, {0, 0, 1, 0}};
  // Voltage over coil k per unknown j.
  const auto over = [&](int k, int j) {
    Complex P = 0.0, N = 0.0;
    for (int c = 0; c < 4; ++c) {
      P += share[c] * axis[c] * from[c][j] / 3.0;
      N += share[c] * std::conj(axis[c]) * from[c][j] / 3.0;
    }
    return share[k] * (z * from[k][j] + Z_p * P * std::conj(axis[k]) + Z_n * N * axis[k]);
  };
  Complex A[5][6] = {};  // unknowns i_a, i_b, i_c, i_f, star point
  for (int j = 0; j < 4; ++j) {
    A[0][j] = over(0, j) + over(1, j);
    A[1][j] = over(2, j);
    A[2][j] = over(3, j);
    A[3][j] = over(1, j) - (j == 3 ? R_f : 0.0);
  }
  for (int k = 0; k < 3; ++k) {
    A[k][4] = 1.0;
    A[k][5] = V * std::conj(axis[k + 1]);
    A[4][k] = 1.0;
  }
  for (int p = 0; p < 5; ++p) {
    int best = p;
    for (int r = p; r < 5; ++r) best = std::abs(A[r][p]) > std::abs(A[best][p]) ? r : best;
    std::swap(A[p], A[best]);
    for (int r = 0; r < 5; ++r) {
      const Complex f = r == p ? 0.0 : A[r][p] / A[p][p];
      for (int c = p; c < 6; ++c) A[r][c] -= f * A[p][c];
    }
  }
  Complex i[4];
  for (int k = 0; k < 4; ++k) i[k] = A[k][5] / A[k][k];
  const double phases_W =
      (1.0 - mu) * std::norm(i[0]) + mu * std::norm(i[0] - i[3]) + std::norm(i[1]) + std::norm(i[2]);
  return {(i[0] + turn * i[1] + turn * turn * i[2]) / 3.0,
          std::conj(i[0] + turn * turn * i[1] + turn * i[2]) / 3.0, i[3],
          0.5 * (kRs * phases_W + R_f * std::norm(i[3]))};
}

TEST(ShortedTurns, DrawsAndBurnsWhatTheWindingCoilByCoilDoes) {
  for (const auto& [mu, R_f] : {std::pair{0.02, 0.05}, {0.1, 0.02}, {0.4, 0.0}}) {
    PlantConfig c = held_speed(kRpm);
    c.effects = {std::make_shared<ShortedTurns>(ShortedTurns::Config{{mu, 0.0, 0.0}, R_f})};
    Plant plant(c);
    run(plant, kLine, 4.0);
    Line base(kF, 60e-6, kWindow), negative(-kF, 60e-6, kWindow);
    double copper_W = 0.0;
    for (int k = 0; k < kWindow; ++k) {
      plant.step(kLine.at(plant));
      base.add(plant.state().i_s), negative.add(plant.state().i_s);
      copper_W += plant.powers().stator_copper_W / kWindow;
    }
    const CoilByCoil expected = coil_by_coil(mu, R_f, kLine.fundamental_V(plant));
    std::printf(
        "%.0f %% of the turns shorted: %.1f A circulate, %.3f A negative sequence, %.0f W in the winding\n",
        100.0 * mu, std::abs(expected.fault), negative.amplitude(), copper_W);
    EXPECT_NEAR(base.amplitude(), std::abs(expected.positive), 1e-4 * base.amplitude());
    EXPECT_NEAR(negative.amplitude(), std::abs(expected.negative), 1e-3 * negative.amplitude());
    EXPECT_NEAR(copper_W, expected.copper_W, 1e-3 * copper_W);
    EXPECT_GT(std::abs(expected.fault), 15.0);
  }
}

// Direct current sees resistors alone: a phase of which a part is bridged.
TEST(ShortedTurns, AreABridgedResistorUnderDirectCurrent) {
  const double mu = 0.2, R_f = 0.1;
  for (const std::size_t phase : {0u, 1u, 2u}) {
    PlantConfig c = held_speed(0.0);
    ShortedTurns::Config fault{{}, R_f};
    fault.share[phase] = mu;
    c.effects = {std::make_shared<ShortedTurns>(fault)};
    Plant plant(c);
    hold(plant, command(std::polar(4.0, 2.0 * kPi / 3.0 * static_cast<double>(phase))), 8.0);
    const double bridged = (1.0 - mu) * kRs + mu * kRs * R_f / (mu * kRs + R_f);
    EXPECT_NEAR(phases(plant.state().i_s)[phase], 6.0 / (bridged + 0.5 * kRs), 1e-3) << phase;
  }
}

// With the gates off the terminals carry nothing, while the coil's current goes on until its own resistance
// has burnt what was stored.
TEST(ShortedTurns, GoOnCirculatingBehindOpenTerminals) {
  PlantConfig c = held_speed(kRpm);
  c.effects = {std::make_shared<ShortedTurns>(ShortedTurns::Config{{0.0, 0.1, 0.0}, 0.0})};
  Plant plant(c);
  run(plant, kLine, 1.0);
  hold(plant, {}, 0.02);
  double heat_J = 0.0, last_W = plant.powers().stator_copper_W, at_once_W = last_W;
  for (int k = 0; k < 3000; ++k) {
    plant.step({});
    ASSERT_LT(std::abs(plant.state().i_s), 1e-8);
    const double now_W = plant.powers().stator_copper_W;
    heat_J += 0.5 * 60e-6 * (now_W + last_W);
    last_W = now_W;
  }
  EXPECT_GT(at_once_W, 10.0);  // the turning rotor's flux drives it
  EXPECT_GT(heat_J, 0.5);
  hold(plant, {}, 4.0);
  EXPECT_LT(plant.powers().stator_copper_W, 1e-3);
}

}  // namespace
}  // namespace imrig::plant
