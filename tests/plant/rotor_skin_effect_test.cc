// The deep bar's ladder against the analytic bar, alone and in the machine.

#include "plant/effects/rotor_skin_effect.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <memory>
#include <utility>
#include <vector>

#include "plant/effects/thermal.h"
#include "plant/powers.h"
#include "tests/plant/bench.h"

namespace imrig::plant {
namespace {

using namespace bench;

constexpr double kMu0 = 4e-7 * kPi;
constexpr Complex kJ{0.0, 1.0};

double xi_of(double height_m, double f_Hz, double resistivity) {
  return height_m * std::sqrt(kPi * f_Hz * kMu0 / resistivity);
}
double K_R(double xi) {
  return xi * (std::sinh(2 * xi) + std::sin(2 * xi)) / (std::cosh(2 * xi) - std::cos(2 * xi));
}
double K_X(double xi) {
  return 1.5 / xi * (std::sinh(2 * xi) - std::sin(2 * xi)) / (std::cosh(2 * xi) - std::cos(2 * xi));
}

// Impedance at slip frequency f of a bar of 1 ohm, from the effect's hooks: its equations are linear, so unit
// currents give the matrix of (j w - A) x = b, solved by elimination.
Complex ladder_impedance(const RotorSkinEffect& bar, double f_Hz) {
  constexpr int n = RotorSkinEffect::kLayers;
  Conditions at;
  at.R_r_nominal = at.R.R_r = 1.0;
  const auto rates = [&](const double* own) {
    double d[2 * n];
    bar.derivatives(at, own, d);
    std::vector<Complex> out;
    for (int k = 0; k < n; ++k) out.emplace_back(d[2 * k], d[2 * k + 1]);
    return out;
  };
  Complex M[n][n + 1];
  double own[2 * n] = {};
  at.i_bar = 1.0;
  const auto b = rates(own);
  at.i_bar = 0.0;
  for (int m = 0; m < n; ++m) {
    own[2 * m] = 1.0;
    const auto column = rates(own);
    own[2 * m] = 0.0;
    for (int k = 0; k < n; ++k)
      M[k][m] = (k == m ? kJ * 2.0 * kPi * f_Hz : 0.0) - column[static_cast<std::size_t>(k)];
  }
  for (int k = 0; k < n; ++k) M[k][n] = b[static_cast<std::size_t>(k)];
  for (int k = 0; k < n; ++k) {
    for (int r = 0; r < n; ++r) {
      if (r == k) continue;
      const Complex factor = M[r][k] / M[k][k];
      for (int c = k; c <= n; ++c) M[r][c] -= factor * M[k][c];
    }
  }
  for (int k = 0; k < n; ++k) {
    const Complex x = M[k][n] / M[k][k];
    own[2 * k] = x.real(), own[2 * k + 1] = x.imag();
  }
  RotorDrop drop{1.0, 0.0, 0.0};
  bar.rotor_drop(at, own, drop);
  return drop.R + drop.v_0;
}

TEST(RotorSkinEffect, FollowsTheAnalyticBarUpTo200Hz) {
  for (const double height_m : {0.010, 0.018, 0.025, 0.030, 0.040}) {
    const RotorSkinEffect bar({height_m, 2.83e-8, 1.0});
    const double L_dc = bar.rotor_leakage_H(1.0);
    double worst_R = 0.0, worst_X = 0.0;
    for (double f = 0.5; f <= 200.0; f += 0.5) {
      const double xi = xi_of(height_m, f, 2.83e-8);
      const Complex Z = ladder_impedance(bar, f);
      worst_R = std::max(worst_R, std::abs(Z.real() / K_R(xi) - 1.0));
      worst_X = std::max(worst_X, std::abs(Z.imag() / (2.0 * kPi * f * L_dc * K_X(xi)) - 1.0));
    }
    std::printf("bar %2.0f mm, up to xi %.2f, K_R %.3f, K_X %.3f: worst error R %.4f %%, L %.4f %%\n",
                1e3 * height_m, xi_of(height_m, 200.0, 2.83e-8), K_R(xi_of(height_m, 200.0, 2.83e-8)),
                K_X(xi_of(height_m, 200.0, 2.83e-8)), 100.0 * worst_R, 100.0 * worst_X);
    EXPECT_LT(worst_R, 0.02) << height_m;
    EXPECT_LT(worst_X, 0.02) << height_m;
  }
}

TEST(RotorSkinEffect, IsOneResistanceAndOneInductanceAtZeroFrequency) {
  const RotorSkinEffect bar({0.025, 2.83e-8, 1.0});
  const Complex Z = ladder_impedance(bar, 1e-3);
  EXPECT_NEAR(Z.real(), 1.0, 1e-6);
  EXPECT_NEAR(Z.imag() / (2.0 * kPi * 1e-3), bar.rotor_leakage_H(1.0), 1e-6 * bar.rotor_leakage_H(1.0));
  EXPECT_NEAR(bar.rotor_leakage_H(1.0), kMu0 * 0.025 * 0.025 / 2.83e-8 / 3.0, 1e-10);
}

// Phasor of the stator's current with the rotor's branch at slip frequency f_slip.
Complex circuit_current(const MachineConfig& m, double V, double f_Hz, double f_slip, double height_m,
                        double fraction, double warm) {
  const double w = 2.0 * kPi * f_Hz, w_slip = 2.0 * kPi * f_slip;
  const double xi = xi_of(height_m, f_slip, 2.83e-8 * warm);
  const double R_bar = fraction * m.R_r_ohm * warm;
  const double L_dc = fraction * m.R_r_ohm * kMu0 * height_m * height_m / 2.83e-8 / 3.0;
  const Complex rotor = (R_bar * K_R(xi) + (1.0 - fraction) * m.R_r_ohm * warm +
                         kJ * w_slip * (m.L_r_H - m.L_m_H - L_dc + L_dc * K_X(xi))) *
                        (w / w_slip);
  const Complex main = kJ * w * m.L_m_H;
  return V / (m.R_s_ohm + kJ * w * (m.L_s_H - m.L_m_H) + main * rotor / (main + rotor));
}

struct Case {
  double f_Hz, speed_rpm;
};

TEST(RotorSkinEffect, GivesTheMachineTheCurrentOfTheAnalyticBarTurningOrNot) {
  const double height_m = 0.025, fraction = 0.6;
  for (const double rotor_C : {25.0, 150.0}) {
    for (const Case& k : {Case{5.0, 0.0}, Case{30.0, 0.0}, Case{120.0, 0.0}, Case{60.0, 1700.0},
                          Case{60.0, 900.0}, Case{60.0, -900.0}}) {
      PlantConfig c = config();
      c.integrator.kind = IntegratorConfig::Kind::kRk4;
      c.generator.coupled = false;
      c.mechanics.held_speed_rpm = k.speed_rpm;
      Thermal::Config heat;
      heat.stator_J_per_K = heat.rotor_J_per_K = heat.iron_J_per_K = 1.0;
      heat.rotor_C = rotor_C, heat.speedup = 0.0;
      c.effects = {std::make_shared<Thermal>(heat),
                   std::make_shared<RotorSkinEffect>(RotorSkinEffect::Config{height_m, 2.83e-8, fraction})};
      Plant plant(c);
      const Supply supply{k.f_Hz, 40.0, 0.1};
      run(plant, supply, 4.0);
      const double f_slip = k.f_Hz - kPolePairs * k.speed_rpm / 60.0;
      const double warm = (225.0 + rotor_C) / 250.0;
      const double t = static_cast<double>(plant.index()) * sample_s(plant);
      const Complex i =
          circuit_current(c.machine, supply.fundamental_V(plant), k.f_Hz, f_slip, height_m, fraction, warm) *
          std::polar(1.0, 2.0 * kPi * k.f_Hz * t);
      EXPECT_LT(std::abs(plant.state().i_s - i), 1e-3 * std::abs(i))
          << k.f_Hz << " Hz, " << k.speed_rpm << " rpm, " << rotor_C << " C";
    }
  }
}

TEST(RotorSkinEffect, LeavesTheMachineAtSmallSlipAsItIs) {
  const double f_slip = 0.2;
  PlantConfig c = config();
  c.integrator.kind = IntegratorConfig::Kind::kRk4;
  c.sample_time_ns = 10'000;  // the held steps' ripple, in which the two do differ, goes with its square
  c.generator.coupled = false;
  c.mechanics.held_speed_rpm = 1800.0 - 60.0 * f_slip / kPolePairs;
  c.effects = {std::make_shared<RotorSkinEffect>(RotorSkinEffect::Config{0.02, 2.83e-8, 0.6})};
  Plant deep(c);
  c.effects.clear();
  Plant base(c);
  const Supply supply{60.0, 150.0, 0.1};
  run(deep, supply, 2.5), run(base, supply, 2.5);
  const double i = std::abs(base.state().i_s);
  ASSERT_GT(std::abs(base.state().i_r), 0.2);
  EXPECT_LT(std::abs(deep.state().i_s - base.state().i_s), 1e-5 * i);
  EXPECT_NEAR(deep.powers().rotor_copper_W, base.powers().rotor_copper_W,
              1e-3 * base.powers().rotor_copper_W);
}

double start_up_left_over(double rtol, double* speed_rpm) {
  PlantConfig c = config();
  c.sample_time_ns = 20'000;  // for the sums below
  c.integrator.rtol = rtol;
  c.generator.coupled = false;
  c.effects = {std::make_shared<RotorSkinEffect>(RotorSkinEffect::Config{0.03, 2.83e-8, 0.6})};
  Plant plant(c);
  const Supply supply{60.0, 179.6, 0.05};
  const double h = sample_s(plant);
  double in_J = 0.0, out_J = 0.0;
  Powers last = plant.powers();
  Complex i_last = 0.0;
  while (plant.index() < 25000) {
    plant.step(supply.at(plant));
    const Powers now = plant.powers();
    in_J += h * power_W(plant.state().v_s, 0.5 * (plant.state().i_s + i_last));
    out_J +=
        0.5 * h * (now.stator_copper_W + last.stator_copper_W + now.rotor_copper_W + last.rotor_copper_W);
    last = now, i_last = plant.state().i_s;
  }
  *speed_rpm = plant.state().speed_rpm;
  return (in_J - out_J - last.magnetic_J - last.kinetic_J) / in_J;
}

TEST(RotorSkinEffect, KeepsTheEnergyAndHalvingTheToleranceChangesNothing) {
  double coarse_rpm = 0.0, fine_rpm = 0.0;
  const double coarse = start_up_left_over(1e-8, &coarse_rpm), fine = start_up_left_over(5e-9, &fine_rpm);
  std::printf("left over %.2e and %.2e of the energy in; %.9f and %.9f rpm\n", coarse, fine, coarse_rpm,
              fine_rpm);
  EXPECT_LT(std::abs(coarse), 2e-5);
  EXPECT_LT(std::abs(fine), 2e-5);
  EXPECT_NEAR(coarse_rpm, fine_rpm, 1e-5);
}

TEST(RotorSkinEffect, RefusesABarWithMoreLeakageThanTheRotorHas) {
  PlantConfig c = config();
  c.effects = {std::make_shared<RotorSkinEffect>(RotorSkinEffect::Config{0.06, 2.83e-8, 0.9})};
  EXPECT_ANY_THROW(Plant{c});
}

TEST(RotorSkinEffect, RefusesAFixedStepThatCannotFollowIt) {
  PlantConfig c = config();
  c.effects = {std::make_shared<RotorSkinEffect>(RotorSkinEffect::Config{0.010, 2.83e-8, 0.6})};
  EXPECT_NO_THROW(Plant{c});
  c.integrator.kind = IntegratorConfig::Kind::kRk4;
  EXPECT_ANY_THROW(Plant{c});
}

}  // namespace
}  // namespace imrig::plant
