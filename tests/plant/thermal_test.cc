// The thermal network: analytic limits, resistances, and the energy balance of a heat run with every loss.

#include "plant/effects/thermal.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <memory>

#include "plant/effects/friction.h"
#include "plant/effects/iron_loss.h"
#include "plant/effects/rotor_skin_effect.h"
#include "plant/effects/stray_load_loss.h"
#include "plant/effects/windage.h"
#include "plant/powers.h"
#include "tests/plant/bench.h"

namespace imrig::plant {
namespace {

using namespace bench;

constexpr double kNoDrift = 1e12;  // k: resistances do not follow temperature

// A DC current through the winding of a locked motor, known heat from the first moment on (but for the rise
// of the current): copper that does not follow temperature, iron that hardly warms.
TEST(Thermal, WarmsTheWindingWithItsTimeConstant) {
  Thermal::Config heat;
  heat.stator_J_per_K = 20.0, heat.rotor_J_per_K = 20.0, heat.iron_J_per_K = 1e9;
  heat.stator_iron_W_per_K = 10.0;  // 2 s
  heat.stator_k_C = heat.rotor_k_C = kNoDrift;
  PlantConfig c = config();
  c.mechanics.locked = true;
  c.effects = {std::make_shared<Thermal>(heat)};
  Plant plant(c);
  hold(plant, command(4.0), 8.0);
  const double W = plant.powers().stator_copper_W;
  EXPECT_NEAR(W, 1.5 * 16.0 / kRs, 1e-3 * W);
  const double end_C = 25.0 + W / 10.0, start_C = plant.state().stator_C;
  hold(plant, command(4.0), 4.0);
  const double t = static_cast<double>(std::llround(4.0 / 60e-6)) * 60e-6;
  EXPECT_NEAR(plant.state().stator_C, end_C + (start_C - end_C) * std::exp(-t / 2.0), 1e-4);
  hold(plant, command(4.0), 20.0);
  EXPECT_NEAR(plant.state().stator_C, 25.0 + plant.powers().stator_copper_W / 10.0, 1e-4);
}

TEST(Thermal, SettlesWhereAllHeatGoesToTheAmbient) {
  Thermal::Config heat;
  heat.stator_J_per_K = 2.0, heat.rotor_J_per_K = 2.0, heat.iron_J_per_K = 4.0;
  heat.stator_iron_W_per_K = 8.0, heat.rotor_iron_W_per_K = 5.0, heat.iron_ambient_W_per_K = 3.0;
  heat.fan = 2.0;
  PlantConfig c = config();
  c.generator.coupled = false;
  c.mechanics.held_speed_rpm = 1760.0;
  c.effects = {std::make_shared<Thermal>(heat), std::make_shared<IronLoss>(IronLoss::Config{60.0, 60.0})};
  Plant plant(c);
  run(plant, {60.0, 150.0, 0.1}, 20.0);
  const Powers p = plant.powers();
  const Observed& now = plant.state();
  const double to_air = 3.0 * (1.0 + 2.0 * 1760.0 / 1800.0);
  EXPECT_GT(now.rotor_C, now.iron_C + 5.0);
  EXPECT_NEAR(now.stator_C - now.iron_C, p.stator_copper_W / 8.0, 1e-3 * p.stator_copper_W / 8.0);
  EXPECT_NEAR(now.rotor_C - now.iron_C, p.rotor_copper_W / 5.0, 1e-3 * p.rotor_copper_W / 5.0);
  const double total_W = p.stator_copper_W + p.rotor_copper_W + p.iron_W;
  EXPECT_NEAR(now.iron_C - 25.0, total_W / to_air, 1e-3 * total_W / to_air);
}

TEST(Thermal, ChangesCopperAndAluminiumByTheStandardsCoefficients) {
  Thermal::Config heat;
  heat.stator_J_per_K = heat.rotor_J_per_K = heat.iron_J_per_K = 1.0;
  heat.stator_C = 120.0, heat.rotor_C = 160.0, heat.reference_C = 20.0, heat.speedup = 0.0;
  const Thermal effect(heat);
  double own[3];
  effect.initial(own);
  Conditions at;
  effect.temperatures(at, own, at.temperature);
  Resistances R{0.39, 0.22, 0.0};
  effect.resistances(at, own, R);
  EXPECT_NEAR(R.R_s / 0.39, 1.0 + 100.0 * 0.003922, 1e-4);  // copper, 0.39 % per K at 20 C
  EXPECT_NEAR(R.R_r / 0.22, 1.0 + 140.0 * 0.004082, 1e-4);  // aluminium
}

TEST(Thermal, RunsASoakFasterByTheSpeedup) {
  const auto after = [](double speedup, double duration_s) {
    Thermal::Config heat;
    heat.stator_J_per_K = 200.0, heat.rotor_J_per_K = 200.0, heat.iron_J_per_K = 400.0;
    heat.stator_iron_W_per_K = heat.rotor_iron_W_per_K = heat.iron_ambient_W_per_K = 10.0;
    heat.speedup = speedup;
    heat.stator_k_C = heat.rotor_k_C = kNoDrift;
    PlantConfig c = config();
    c.mechanics.locked = true;
    c.effects = {std::make_shared<Thermal>(heat)};
    Plant plant(c);
    hold(plant, command(5.0), duration_s);
    return plant.state().stator_C;
  };
  const double slow = after(1.0, 40.0), fast = after(10.0, 4.0), held = after(0.0, 4.0);
  EXPECT_GT(slow, 29.0);
  EXPECT_NEAR(fast - 25.0, slow - 25.0, 0.1 * (slow - 25.0));  // the current's rise is not faster
  EXPECT_EQ(held, 25.0);
}

// Electrical in = shaft to the generator + heat stored + heat to the ambient + magnetic + kinetic.
TEST(Thermal, BalancesTheEnergyOfAHeatRunWithEveryLoss) {
  Thermal::Config heat;
  heat.stator_J_per_K = 12.0, heat.rotor_J_per_K = 10.0, heat.iron_J_per_K = 40.0;
  heat.stator_iron_W_per_K = 6.0, heat.rotor_iron_W_per_K = 4.0, heat.iron_ambient_W_per_K = 2.0;
  heat.fan = 1.5;
  const auto thermal = std::make_shared<Thermal>(heat);
  PlantConfig c = config();
  c.effects = {thermal,
               std::make_shared<Friction>(Friction::Config{0.25, 0.0015, 0.2}),
               std::make_shared<Windage>(Windage::Config{2e-6, 1e-8}),
               std::make_shared<StrayLoadLoss>(StrayLoadLoss::Config{75.0}),
               std::make_shared<IronLoss>(IronLoss::Config{60.0, 60.0}),
               std::make_shared<RotorSkinEffect>(RotorSkinEffect::Config{0.025, 2.83e-8, 0.6})};
  c.integrator.kind = IntegratorConfig::Kind::kRk4;
  Plant plant(c);
  plant.set_excitation({60.0, 1.0, true, 0.0, 0.0});
  const Supply supply{60.0, 179.6, 0.05};
  const double h = sample_s(plant);
  double in_J = 0.0, shaft_J = 0.0, ambient_J = 0.0, loss_J = 0.0;
  const auto losses_W = [](const Powers& p) {
    return p.stator_copper_W + p.rotor_copper_W + p.iron_W + p.drag_W;
  };
  const auto air_W = [&] { return thermal->to_ambient_W(plant.state().w_mech_rad_s, plant.state().iron_C); };
  Powers last = plant.powers();
  Complex i_last = 0.0;
  double air_last = air_W();
  while (plant.index() < 200000) {
    plant.step(supply.at(plant));
    const Powers now = plant.powers();
    in_J += h * power_W(plant.state().v_s, 0.5 * (plant.state().i_s + i_last));
    shaft_J += 0.5 * h * (now.generator_shaft_W + last.generator_shaft_W);
    ambient_J += 0.5 * h * (air_W() + air_last);
    loss_J += 0.5 * h * (losses_W(now) + losses_W(last));
    last = now, i_last = plant.state().i_s, air_last = air_W();
  }
  const Observed& now = plant.state();
  const double stored_J =
      12.0 * (now.stator_C - 25.0) + 10.0 * (now.rotor_C - 25.0) + 40.0 * (now.iron_C - 25.0);
  const double left_J = in_J - shaft_J - stored_J - ambient_J - last.magnetic_J - last.kinetic_J;
  std::printf(
      "in %.1f J = shaft %.1f + heat stored %.1f + to the air %.1f + magnetic %.2f + kinetic %.1f; left over "
      "%.2e of it; %.0f, %.0f, %.0f C\n",
      in_J, shaft_J, stored_J, ambient_J, last.magnetic_J, last.kinetic_J, left_J / in_J, now.stator_C,
      now.rotor_C, now.iron_C);
  EXPECT_GT(stored_J, 1000.0);
  EXPECT_GT(ambient_J, 500.0);
  EXPECT_GT(shaft_J, 1000.0);
  EXPECT_NEAR(left_J, 0.0, 1e-3 * in_J);
  EXPECT_NEAR(stored_J + ambient_J, loss_J, 1e-3 * loss_J);  // all heat by kind is heat in the network
}

}  // namespace
}  // namespace imrig::plant
