// Saturation: the curves' limits, one energy behind all three kinds, and what the 5 hp motor shows of them.

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <memory>
#include <random>

#include "plant/effects/cross_saturation.h"
#include "plant/effects/leakage_saturation.h"
#include "plant/effects/magnetizing_saturation.h"
#include "plant/magnetic_circuit.h"
#include "plant/powers.h"
#include "plant/t_circuit.h"
#include "tests/plant/bench.h"

namespace imrig::plant {
namespace {

using namespace bench;

const MachineConfig kMachine = config().machine;
const double kLs = kMachine.L_s_H, kLmT = kMachine.L_m_H, kLeak = kLs - kLmT;

// The 5 hp motor: rated flux 0.48 Wb and 14 to 18 A peak.
const SaturationLaw kMain{0.15, 0.52, 0.4}, kStatorLeakage{0.5, 55.0, 0.3}, kRotorLeakage{0.45, 50.0, 0.3},
    kTeeth{0.2, 0.5, 0.3};
const MagneticLaws kAll{kMain, kStatorLeakage, kRotorLeakage, kTeeth, 0.6};

using Fluxes = std::array<double, 4>;  // psi_s, psi_r

std::array<double, 4> currents(const MagneticCircuit& circuit, const Fluxes& x) {
  const Currents i = circuit.solve({x[0], x[1]}, {x[2], x[3]}).i;
  return {i.s.real(), i.s.imag(), i.r.real(), i.r.imag()};
}

std::array<std::array<double, 4>, 4> matrix(const MagneticCircuit::Incremental& m) {
  return {{{m.ss.xx, m.ss.xy, m.sr.xx, m.sr.xy},
           {m.ss.yx, m.ss.yy, m.sr.yx, m.sr.yy},
           {m.sr.xx, m.sr.yx, m.rr.xx, m.rr.xy},
           {m.sr.xy, m.sr.yy, m.rr.yx, m.rr.yy}}};
}

// Fluxes as they occur, up to four times rated, leakage up to ten times rated current.
std::vector<Fluxes> many_fluxes(int n) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  std::vector<Fluxes> all;
  for (int k = 0; k < n; ++k) {
    const double main = std::exp(0.8 * normal(random)), leak = 0.3 * std::exp(normal(random));
    const double a = main * normal(random), b = main * normal(random);
    all.push_back(
        {0.3 * a, 0.3 * b, 0.3 * a + 0.3 * leak * normal(random), 0.3 * b + 0.3 * leak * normal(random)});
  }
  return all;
}

TEST(TwoSlope, IsNearAPointWhatItIsThere) {
  for (const double softness : {0.05, 0.2, 0.5, 0.7, 0.95}) {
    const TwoSlope curve(58.0, 0.5, softness);
    double worst_A = 0.0, worst_slope = 0.0;
    int near_by = 0;
    for (double x0 = 0.0; x0 < 1.5; x0 += 0.005) {
      TwoSlope::Near near;
      curve.tangent(x0 * x0, near);
      for (double away = -0.1; away < 0.1; away += 2e-4) {
        const double x2 = x0 * x0 + away;
        TwoSlope::Near moved = near;
        const TwoSlope::Tangent got = curve.tangent(std::max(x2, 0.0), moved);
        if (x2 < 0.0 || moved.x2 != near.x2) continue;
        const TwoSlope::Tangent there = curve.tangent(x2);
        ++near_by;
        worst_A = std::max(worst_A, std::sqrt(x2) * std::abs(got.secant - there.secant));
        worst_slope = std::max(worst_slope, x2 * std::abs(got.rank - there.rank));
      }
    }
    EXPECT_GT(near_by, 1000) << softness;
    EXPECT_LT(worst_A, TwoSlope::kNear_A) << softness;
    EXPECT_LT(worst_slope, 2e-4 * curve.final_slope()) << softness;
  }
}

TEST(TwoSlope, RisesFromNoSlopeToItsFinalSlopeAndMeetsTheAxisAtTheKnee) {
  for (const double softness : {0.05, 0.4, 0.95}) {
    const TwoSlope curve(8.0, 0.5, softness);
    const auto h = [&](double x) { return x * curve.secant(x * x); };
    EXPECT_NEAR(h(1e-3) / 1e-3, 0.0, 1e-3);
    EXPECT_NEAR((h(500.0) - h(400.0)) / 100.0, 8.0, 1e-5);
    EXPECT_NEAR(400.0 - h(400.0) / 8.0, 0.5, 1e-2 * 0.5);
    double last = 0.0;
    for (double x = 0.01; x < 5.0; x *= 1.1) {
      const TwoSlope::Tangent t = curve.tangent(x * x);
      const double slope = t.secant + t.rank * x * x;
      EXPECT_NEAR(slope, (h(x + 1e-6) - h(x - 1e-6)) / 2e-6, 1e-6) << x;
      EXPECT_GT(slope, last);
      EXPECT_LT(slope, 8.0);
      last = slope;
      EXPECT_NEAR((curve.energy(x + 1e-5) - curve.energy(x - 1e-5)) / 2e-5, h(x), 1e-8 + 1e-8 * h(x)) << x;
    }
    EXPECT_EQ(curve.energy(0.0), 0.0);
  }
}

TEST(MagneticCircuit, IsTheLinearMachineForSmallFluxes) {
  const MagneticCircuit bent(kMachine, kAll);
  const TCircuit linear(kMachine);
  const Complex psi_s{3e-4, -1e-4}, psi_r{2e-4, 1e-4};
  const Currents i = bent.solve(psi_s, psi_r).i, expected = linear.currents(psi_s, psi_r);
  EXPECT_LT(std::abs(i.s - expected.s), 1e-5 * std::abs(expected.s));
  EXPECT_LT(std::abs(i.r - expected.r), 1e-5 * std::abs(expected.r));
}

// Along the flux, collinear: the inverse of the incremental matrix is that of a T circuit.
TEST(MagneticCircuit, HasTheStatedSlopesFarBeyondTheKnees) {
  const auto slopes = [](const MagneticLaws& laws, double psi_s, double psi_r) {
    const auto m = MagneticCircuit(kMachine, laws).incremental(psi_s, psi_r);
    const double D = m.ss.xx * m.rr.xx - m.sr.xx * m.sr.xx;
    const double L_m = -m.sr.xx / D;
    return std::array<double, 3>{m.rr.xx / D - L_m, m.ss.xx / D - L_m, L_m};  // leakages, main
  };
  MagneticLaws main;
  main.main = kMain;
  const auto m = slopes(main, 50.0, 50.0);
  EXPECT_NEAR(m[2], kMain.saturated_ratio * kLmT, 1e-4 * kLmT);
  EXPECT_NEAR(m[0], kLeak, 1e-6 * kLeak);
  MagneticLaws leakage;
  leakage.stator_leakage = kStatorLeakage, leakage.rotor_leakage = kRotorLeakage;
  const auto l = slopes(leakage, 20.0, -20.0);
  EXPECT_NEAR(l[0], kStatorLeakage.saturated_ratio * kLeak, 1e-3 * kLeak);
  EXPECT_NEAR(l[1], kRotorLeakage.saturated_ratio * kLeak, 1e-3 * kLeak);
  EXPECT_NEAR(l[2], kLmT, 1e-6 * kLmT);
  MagneticLaws teeth;
  teeth.teeth = kTeeth;  // share 0: they are a part of the main path
  EXPECT_NEAR(slopes(teeth, 50.0, 50.0)[2], 0.2 * kLmT, 1e-3 * 0.2 * kLmT);
}

TEST(MagneticCircuit, GivesTheCurrentsAsTheGradientOfOneEnergyAndItsMatrixIsReciprocal) {
  const MagneticCircuit circuit(kMachine, kAll);
  for (const Fluxes& x : many_fluxes(200)) {
    const auto i = currents(circuit, x);
    const auto known = matrix(circuit.incremental({x[0], x[1]}, {x[2], x[3]}));
    double largest = 0.0;
    for (const auto& row : known)
      largest = std::max(largest, std::abs(*std::max_element(row.begin(), row.end())));
    for (std::size_t k = 0; k < 4; ++k) {
      const double step = 1e-5;
      Fluxes up = x, down = x;
      up[k] += step, down[k] -= step;
      const double W_up = circuit.energy_J({up[0], up[1]}, {up[2], up[3]});
      const double W_down = circuit.energy_J({down[0], down[1]}, {down[2], down[3]});
      EXPECT_NEAR((W_up - W_down) / (2.0 * step) / 1.5, i[k], 1e-4 + 1e-6 * std::abs(i[k]));
      const auto i_up = currents(circuit, up), i_down = currents(circuit, down);
      for (std::size_t j = 0; j < 4; ++j) {
        EXPECT_NEAR((i_up[j] - i_down[j]) / (2.0 * step), known[j][k], 2e-5 * largest);
        EXPECT_NEAR(known[j][k], known[k][j], 1e-12 * largest);
      }
    }
  }
}

TEST(MagneticCircuit, GainsNothingOnAClosedPathAndPullsOnBothSidesAlike) {
  const MagneticCircuit circuit(kMachine, kAll);
  const int n = 20000;
  double work = 0.0, moved = 0.0;
  Fluxes last{};
  std::array<double, 4> i_last{};
  for (int k = 0; k <= n; ++k) {
    const double t = 2.0 * kPi * k / n;
    const Fluxes x{0.6 * std::cos(t), 0.4 * std::sin(2.0 * t), 0.5 * std::cos(t + 0.2),
                   0.35 * std::sin(2.0 * t)};
    const auto i = currents(circuit, x);
    for (std::size_t j = 0; k > 0 && j < 4; ++j) {
      const double part = 0.5 * (i[j] + i_last[j]) * (x[j] - last[j]);
      work += part, moved += std::abs(part);
    }
    last = x, i_last = i;
    const double stator = x[0] * i[1] - x[1] * i[0], rotor = x[2] * i[3] - x[3] * i[2];
    EXPECT_NEAR(stator, -rotor, 1e-9);
  }
  EXPECT_GT(moved, 50.0);
  EXPECT_LT(std::abs(work), 1e-6 * moved);
}

TEST(MagneticCircuit, SolvesEvenSharpAndDeepCurvesFarBeyondAnyMotor) {
  for (const double ratio : {0.02, 0.3}) {
    for (const double softness : {0.05, 0.95}) {
      const MagneticLaws laws{{ratio, 0.2, softness},
                              {ratio, 5.0, softness},
                              {ratio, 5.0, softness},
                              {ratio, 0.2, softness},
                              0.7};
      const MagneticCircuit circuit(kMachine, laws);
      for (const Fluxes& x : many_fluxes(2000)) {
        for (const double scale : {1e-6, 1.0, 1e3}) {
          const Complex psi_s{scale * x[0], scale * x[1]}, psi_r{scale * x[2], scale * x[3]};
          const auto point = circuit.solve(psi_s, psi_r);
          // What leaves the node: the currents, less what the air gap takes, less what the teeth take.
          const double c = laws.leakage_in_teeth;
          const auto bent = [&](Complex psi) {
            return TwoSlope((1.0 / ratio - 1.0) / kLmT, 0.2, softness).secant(std::norm(psi)) * psi;
          };
          const Complex taken =
              point.psi_m / kLmT + bent(point.psi_m) + bent(point.psi_m + c * (psi_s - point.psi_m));
          const double size = std::abs(point.i.s) + std::abs(point.i.r);
          ASSERT_LT(std::abs(point.i.s + point.i.r - taken), 1e-9 * size)
              << scale << " " << ratio << " " << softness;
        }
      }
    }
  }
}

TEST(MagneticCircuit, NeedsLeakageOnBothSides) {
  PlantConfig c = config();
  c.machine.L_r_H = 0.9 * c.machine.L_m_H, c.machine.L_s_H = 1.3 * c.machine.L_m_H;
  EXPECT_NO_THROW(Plant{c});
  c.effects = {std::make_shared<MagnetizingSaturation>(kMain)};
  EXPECT_ANY_THROW(Plant{c});
}

// i_d moves with i_q at fixed main flux: by the teeth only.
TEST(CrossSaturation, MovesTheMagnetizingCurrentWithTheTorqueCurrentAtFixedMainFlux) {
  const auto magnetizing = [](const MagneticLaws& laws, double i_q) {
    // Fluxes that leave psi_m at 0.5 Wb on the real axis, the rotor's current along the imaginary one, and a
    // leakage flux of the torque current in the stator: the branches by hand, leakages linear.
    const double c = laws.leakage_in_teeth, psi_m = 0.5;
    const auto bent = [](const SaturationLaw& law, Complex psi) {
      return TwoSlope((1.0 / law.saturated_ratio - 1.0) / kLmT, law.knee, law.softness)
                 .secant(std::norm(psi)) *
             psi;
    };
    const Complex i_m = psi_m / kLmT + bent(laws.main, psi_m);
    Complex leak{0.0, kLeak * i_q}, i_t;
    for (int round = 0; round < 100; ++round) {
      i_t = bent(laws.teeth, psi_m + c * leak);
      leak = {kLeak * (i_m + (1.0 - c) * i_t).real(), kLeak * i_q};
    }
    const Complex i_r = i_m + (1.0 - c) * i_t - leak / kLeak;
    const auto p = MagneticCircuit(kMachine, laws).solve(psi_m + leak, psi_m + kLeak * i_r);
    EXPECT_LT(std::abs(p.psi_m - psi_m), 1e-12);
    EXPECT_LT(std::abs(p.i.r - i_r), 1e-9);
    EXPECT_LT(std::abs(p.i.s - leak / kLeak - c * i_t), 1e-9);
    return (p.i.s + p.i.r).real();
  };
  MagneticLaws main, cross;
  main.main = kMain;
  cross = main, cross.teeth = kTeeth, cross.leakage_in_teeth = 0.8;
  EXPECT_NEAR(magnetizing(main, 40.0), magnetizing(main, 0.0), 1e-9);
  const double none = magnetizing(cross, 0.0), much = magnetizing(cross, 40.0);
  std::printf("cross-saturation: magnetizing current %.2f A without, %.2f A with 40 A of torque current\n",
              none, much);
  EXPECT_GT(much, 1.01 * none);
}

PlantConfig saturated(std::shared_ptr<const Effect> effect) {
  PlantConfig c = config();
  c.generator.coupled = false;
  c.effects = {std::move(effect)};
  return c;
}

// Rated voltage and frequency: i_0 from the curve i_m(psi) and psi = V/w, within the stator's drops.
TEST(MagnetizingSaturation, DrawsTheNoLoadCurveOfAFiveHorsepowerMotor) {
  const double w = 2.0 * kPi * 60.0;
  double last_slope = 0.0, last_i = 0.0, rated_A = 0.0, over_A = 0.0;
  for (const double V : {45.0, 90.0, 135.0, 180.0, 225.0}) {
    PlantConfig c = saturated(std::make_shared<MagnetizingSaturation>(kMain));
    c.mechanics.J_kgm2 = 0.01;
    Plant plant(c);
    run(plant, {60.0, V, 0.2}, 3.0);
    const double i = std::abs(plant.state().i_s);
    // The same by hand: |v| = |R i + j w (L_leak i + psi)|, i along psi, bisection over psi.
    double low = 0.0, high = 2.0;
    const TwoSlope extra((1.0 / kMain.saturated_ratio - 1.0) / kLmT, kMain.knee, kMain.softness);
    const auto current = [&](double psi) { return psi / kLmT + psi * extra.secant(psi * psi); };
    for (int k = 0; k < 60; ++k) {
      const double psi = 0.5 * (low + high), a = current(psi);
      (std::hypot(kRs * a, w * (kLeak * a + psi)) > V ? high : low) = psi;
    }
    EXPECT_NEAR(i, current(low), 0.004 * i + 0.02) << V;  // ripple of the held voltage
    std::printf("no load, %.0f V peak at 60 Hz: %.2f A (linear %.2f A)\n", V, i, V / (w * kLs));
    const double slope = (i - last_i) / 45.0;
    EXPECT_GT(slope, 0.999 * last_slope);  // bends upwards all the way
    last_slope = slope, last_i = i;
    if (V == 180.0) rated_A = i;
    if (V == 225.0) over_A = i;
  }
  // A motor of this size draws 30 to 60 % of its rated 18 A without load, and well above in proportion
  // beyond.
  EXPECT_GT(rated_A, 0.3 * 18.0);
  EXPECT_LT(rated_A, 0.6 * 18.0);
  EXPECT_GT(over_A / rated_A, 1.4);
}

TEST(MagnetizingSaturation, IsAlmostAbsentAtConstantFluxWithChangingLoad) {
  double least = 1.0, most = 0.0;
  for (const double excitation_A : {0.0, 0.8, 1.5}) {
    PlantConfig c = saturated(std::make_shared<MagnetizingSaturation>(kMain));
    c.generator.coupled = true;
    Plant plant(c);
    plant.set_excitation({60.0, excitation_A, excitation_A > 0.0, 0.0, 0.0});
    run(plant, {60.0, 179.6, 0.2}, 3.0);
    const auto& now = plant.state();
    const Complex psi_m = now.psi_s - kLeak * now.i_s;
    const double L = std::abs(psi_m) / std::abs(now.i_s + now.i_r);
    least = std::min(least, L), most = std::max(most, L);
  }
  const double at_half_voltage = [] {
    PlantConfig c = saturated(std::make_shared<MagnetizingSaturation>(kMain));
    Plant plant(c);
    run(plant, {60.0, 90.0, 0.2}, 3.0);
    return std::abs(plant.state().psi_s - kLeak * plant.state().i_s) /
           std::abs(plant.state().i_s + plant.state().i_r);
  }();
  std::printf("L_m %.1f to %.1f mH from no load to full load at 180 V, %.1f mH at 90 V\n", 1e3 * least,
              1e3 * most, 1e3 * at_half_voltage);
  EXPECT_LT(most / least, 1.10);
  EXPECT_GT(at_half_voltage / most, 1.2);
}

TEST(LeakageSaturation, ShowsAboveTwiceRatedCurrentAtLockedRotor) {
  const auto reactance = [](double V) {  // of the locked motor, from the power that flows
    PlantConfig c = saturated(std::make_shared<LeakageSaturation>(kStatorLeakage, kRotorLeakage));
    c.mechanics.locked = true;
    Plant plant(c);
    run(plant, {60.0, V, 0.1}, 1.5);
    Complex S = 0.0;
    double i2 = 0.0;
    for (int k = 0; k < 2778; ++k) {  // ten periods
      const Complex before = plant.state().i_s;
      plant.step(Supply{60.0, V}.at(plant));
      const Complex mean = 0.5 * (before + plant.state().i_s);
      S += plant.state().v_s * std::conj(mean), i2 += std::norm(mean);
    }
    return std::array<double, 2>{S.imag() / i2, std::sqrt(i2 / 2778.0)};
  };
  const auto small = reactance(5.0), rated = reactance(45.0), large = reactance(180.0);
  std::printf("locked at 60 Hz: X %.3f ohm at %.1f A, %.3f at %.1f A, %.3f at %.1f A\n", small[0], small[1],
              rated[0], rated[1], large[0], large[1]);
  EXPECT_NEAR(rated[0] / small[0], 1.0, 0.02);
  EXPECT_GT(large[1], 2.0 * 18.0);
  EXPECT_LT(large[0] / small[0], 0.8);  // published: 20 to 40 % lower
  EXPECT_GT(large[0] / small[0], 0.6);
}

TEST(Saturation, KeepsTheEnergyBalanceOverAStartUpAndARunDown) {
  PlantConfig c = config();
  c.sample_time_ns = 20'000, c.pwm_time_ns = 240'000;
  c.effects = {std::make_shared<MagnetizingSaturation>(kMain),
               std::make_shared<LeakageSaturation>(kStatorLeakage, kRotorLeakage),
               std::make_shared<CrossSaturation>(kTeeth, 0.6)};
  c.generator.coupled = false;
  Plant plant(c);
  const Supply supply{60.0, 179.6, 0.02};
  const double h = sample_s(plant);
  double in_J = 0.0, heat_J = 0.0, most_magnetic_J = 0.0;
  Powers last = plant.powers();
  Complex i_last = plant.state().i_s;
  const auto tally = [&](const InverterCommand& command) {
    plant.step(command);
    const Powers now = plant.powers();
    if (command.gates_on) in_J += h * power_W(plant.state().v_s, 0.5 * (plant.state().i_s + i_last));
    heat_J +=
        0.5 * h * (now.stator_copper_W + now.rotor_copper_W + last.stator_copper_W + last.rotor_copper_W);
    most_magnetic_J = std::max(most_magnetic_J, now.magnetic_J);
    last = now, i_last = plant.state().i_s;
  };
  while (plant.index() < 50000) tally(supply.at(plant));
  EXPECT_NEAR(in_J, heat_J + last.magnetic_J + last.kinetic_J, 1e-4 * in_J);
  std::printf(
      "start-up with three saturations: in %.2f J, heat %.2f, magnetic %.3f (at most %.2f), kinetic %.2f\n",
      in_J, heat_J, last.magnetic_J, most_magnetic_J, last.kinetic_J);
  EXPECT_GT(last.kinetic_J, 700.0);
  EXPECT_GT(most_magnetic_J, 2.0);
  double stored_J = last.magnetic_J + last.kinetic_J;
  for (int k = 0; k < 20000; ++k) {  // gates off: diodes give back to the link or block, nothing arises
    tally({});
    EXPECT_LT(last.magnetic_J + last.kinetic_J, stored_J + 1e-6);
    stored_J = last.magnetic_J + last.kinetic_J;
  }
  EXPECT_EQ(plant.state().i_s, Complex(0.0));
}

TEST(Saturation, LeavesEveryBitWhenItsRatiosAreOne) {
  const auto trace = [](std::vector<std::shared_ptr<const Effect>> effects) {
    PlantConfig c = config();
    c.effects = std::move(effects);
    Plant plant(c);
    std::vector<double> values;
    for (int k = 0; k < 4000; ++k) {
      plant.step(k < 3000 ? Supply{60.0, 150.0}.at(plant) : InverterCommand{});
      values.insert(values.end(), {plant.state().i_s.real(), plant.state().psi_r.imag(),
                                   plant.state().w_mech_rad_s, plant.powers().magnetic_J});
    }
    return values;
  };
  const auto base = trace({});
  EXPECT_EQ(
      base,
      trace({std::make_shared<MagnetizingSaturation>(SaturationLaw{1.0, 0.3, 0.4}),
             std::make_shared<LeakageSaturation>(SaturationLaw{1.0, 10.0, 0.4}, SaturationLaw{1.0, 5.0, 0.4}),
             std::make_shared<CrossSaturation>(SaturationLaw{1.0, 0.3, 0.4}, 0.5)}));
  EXPECT_NE(base, trace({std::make_shared<MagnetizingSaturation>(kMain)}));
}

// Halving the tolerance and the other integrator change nothing that matters.
TEST(Saturation, ConvergesWithTheIntegrator) {
  const auto end = [](IntegratorConfig integrator) {
    PlantConfig c = config();
    c.integrator = integrator;
    c.effects = {std::make_shared<MagnetizingSaturation>(kMain),
                 std::make_shared<LeakageSaturation>(kStatorLeakage, kRotorLeakage),
                 std::make_shared<CrossSaturation>(kTeeth, 0.6)};
    Plant plant(c);
    run(plant, {60.0, 179.6}, 0.3);
    return plant.state();
  };
  const auto reference = end({IntegratorConfig::Kind::kSundials, 1e-10, 1e-12});
  const auto shipped = end({}), rk4 = end({IntegratorConfig::Kind::kRk4, 0.0, 0.0});
  for (const auto& other : {shipped, rk4}) {
    EXPECT_LT(std::abs(other.i_s - reference.i_s), 1e-3);
    EXPECT_LT(std::abs(other.speed_rpm - reference.speed_rpm), 1e-2);
  }
}

// From far away, from near, and from so near that the tangents serve; the same currents as without a neighbour.
TEST(MagneticCircuit, PointsFollowedFromAnyNeighbourAreTheSolvedOnes) {
  const MagneticCircuit circuit(kMachine, kAll);
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  double worst_A = 0.0;
  for (const double apart_Wb : {1.0, 1e-2, 1e-3, 3e-5, 1e-6, 0.0}) {
    MagneticCircuit::Known known;
    for (const Fluxes& x : many_fluxes(300)) {
      Complex psi_s{x[0], x[1]}, psi_r{x[2], x[3]};
      for (int k = 0; k < 3; ++k) {
        const auto followed = circuit.follow(psi_s, psi_r, known), solved = circuit.solve(psi_s, psi_r);
        worst_A = std::max({worst_A, std::abs(followed.i.s - solved.i.s), std::abs(followed.i.r - solved.i.r)});
        psi_s += apart_Wb * Complex(normal(random), normal(random));
        psi_r += apart_Wb * Complex(normal(random), normal(random));
      }
    }
  }
  std::printf("followed from solved points: %.1e A at most\n", worst_A);
  EXPECT_GT(worst_A, 0.0);
  EXPECT_LT(worst_A, MagneticCircuit::kFollowed_A);
}

}  // namespace
}  // namespace imrig::plant
