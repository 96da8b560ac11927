// Iron loss, stray load loss, windage: each against its equation in a running machine, and neutral.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "plant/effects/iron_loss.h"
#include "plant/effects/stray_load_loss.h"
#include "plant/effects/windage.h"
#include "plant/powers.h"
#include "tests/plant/bench.h"

namespace imrig::plant {
namespace {

using namespace bench;

Plant idling(const std::shared_ptr<const Effect>& effect, double f_Hz, double V, double duration_s) {
  PlantConfig c = config();
  c.integrator.kind = IntegratorConfig::Kind::kRk4;
  c.generator.coupled = false;
  c.mechanics.held_speed_rpm = 60.0 * f_Hz / kPolePairs;
  c.effects = {effect};
  Plant plant(c);
  run(plant, {f_Hz, V, 0.2}, duration_s);
  return plant;
}

TEST(IronLoss, GoesWithFrequencyAndFluxAsItsEquationSays) {
  for (const double exponent : {1.6, 2.0, 2.4}) {
    const IronLoss::Config config{90.0, 60.0, 0.45, 60.0, exponent, 0.002};
    for (const auto& [f, V] : {std::pair{60.0, 180.0}, {60.0, 60.0}, {15.0, 45.0}, {90.0, 180.0}}) {
      const Plant plant = idling(std::make_shared<IronLoss>(config), f, V, 2.5);
      const double psi = std::abs(plant.state().psi_r) / 0.45, n = f / 60.0;
      const double expected_W = 90.0 * n * std::pow(psi, exponent) + 60.0 * n * n * psi * psi;
      EXPECT_NEAR(plant.powers().iron_W, expected_W, 1e-3 * expected_W) << f << " Hz " << V << " V";
    }
  }
}

TEST(IronLoss, TakesItsPowerFromTheSupplyAndBrakesNothing) {
  Plant plant = idling(std::make_shared<IronLoss>(IronLoss::Config{90.0, 60.0}), 60.0, 180.0, 3.0);
  const Complex before = plant.state().i_s;
  plant.step(Supply{60.0, 180.0}.at(plant));
  // The held voltage and the mean current of a step give the power that flows in.
  const double in_W = power_W(plant.state().v_s, 0.5 * (before + plant.state().i_s));
  const Powers p = plant.powers();
  EXPECT_GT(p.iron_W, 100.0);
  EXPECT_NEAR(in_W, p.stator_copper_W + p.iron_W, 1e-3 * in_W);
  EXPECT_NEAR(plant.state().torque_Nm, 0.0, 1e-3);
}

TEST(IronLoss, IsNeverNegativeAndVanishesWithoutFluxOrChange) {
  PlantConfig c = config();
  c.effects = {std::make_shared<IronLoss>(IronLoss::Config{90.0, 60.0})};
  Plant plant(c);
  for (int k = 0; k < 30000; ++k) {
    plant.step(Supply{60.0, 180.0}.at(plant));
    ASSERT_GE(plant.powers().iron_W, 0.0);
  }
  PlantConfig still = config();
  still.mechanics.locked = true;
  still.effects = c.effects;
  Plant dc(still);
  hold(dc, command(4.0), 5.0);
  EXPECT_GT(std::abs(dc.state().psi_r), 0.5);
  EXPECT_LT(dc.powers().iron_W, 1e-6);
}

PlantConfig loaded(const std::shared_ptr<const Effect>& effect) {
  PlantConfig c = config();
  c.generator.coupled = false;
  c.mechanics.held_speed_rpm = 1750.0;
  if (effect) c.effects = {effect};
  return c;
}

TEST(StrayLoadLoss, IsTheAssignedPowerAndBrakesTheShaftForIt) {
  Plant without(loaded(nullptr));
  run(without, {60.0, 179.6, 0.1}, 2.0);
  const double i = std::abs(without.state().i_s), T = without.state().torque_Nm;
  for (const auto basis : {StrayLoadLoss::Basis::kCurrent, StrayLoadLoss::Basis::kTorque}) {
    Plant plant(
        loaded(std::make_shared<StrayLoadLoss>(StrayLoadLoss::Config{75.0, basis, 10.0, 12.0, 1800.0, 2.5})));
    run(plant, {60.0, 179.6, 0.1}, 2.0);
    const double g = basis == StrayLoadLoss::Basis::kCurrent ? i * i / 100.0 : T * T / 144.0;
    const double expected_W = 75.0 * g * std::pow(1750.0 / 1800.0, 2.5);
    const Powers p = plant.powers();
    EXPECT_NEAR(p.stray_W, expected_W, 1e-3 * expected_W);
    EXPECT_NEAR(p.drag_W, p.stray_W, 1e-9);
    EXPECT_EQ(plant.state().i_s, without.state().i_s);  // nothing but the shaft feels it
  }
}

TEST(StrayLoadLoss, BrakesBothDirectionsAndRestsAtRest) {
  const StrayLoadLoss stray({75.0, StrayLoadLoss::Basis::kCurrent, 10.0, 12.0, 1800.0, 1.0});
  const auto torque = [&](double w) {
    Conditions at;
    at.w_mech = w, at.i.s = 10.0;
    return stray.drag_Nm(at, nullptr);
  };
  EXPECT_EQ(torque(0.0), 0.0);
  EXPECT_NEAR(torque(100.0), 75.0 / rad_s_of_rpm(1800.0), 1e-5);
  EXPECT_EQ(torque(-100.0), -torque(100.0));
}

// J dw/dt = -c w^2 has w_0/(1 + c w_0 t/J), and with a cubic law alone w_0/sqrt(1 + 2 c w_0^2 t/J).
TEST(Windage, LetsTheShaftCoastDownAsItsEquationSays) {
  for (const bool cubic : {false, true}) {
    PlantConfig c = config();
    c.generator.coupled = false;
    c.effects = {std::make_shared<Windage>(cubic ? Windage::Config{0.0, 2e-7} : Windage::Config{4e-5, 0.0})};
    Plant plant(c);
    run(plant, {60.0, 150.0, 0.1}, 1.5);
    hold(plant, {}, 3.0);  // until the rotor's flux is gone
    const double w_0 = plant.state().w_mech_rad_s;
    ASSERT_GT(w_0, 50.0);
    hold(plant, {}, 4.0);
    const double t = static_cast<double>(std::llround(4.0 / 60e-6)) * 60e-6, J = c.mechanics.J_kgm2;
    const double expected =
        cubic ? w_0 / std::sqrt(1.0 + 2.0 * 2e-7 * w_0 * w_0 * t / J) : w_0 / (1.0 + 4e-5 * w_0 * t / J);
    EXPECT_NEAR(plant.state().w_mech_rad_s, expected, 1e-5 * w_0);
  }
}

std::vector<double> trace(const std::string& effects, IntegratorConfig::Kind kind) {
  PlantConfig c = config();
  c.integrator.kind = kind;
  const std::string motor =
      "version = 1\n[motor]\ncircuit = \"inverse-gamma\"\npole_pairs = 2\nR_s_ohm = 0.39\nR_r_ohm = 0.22\n"
      "L_l_H = 0.006\nL_m_H = 0.068\n";
  c.effects = parse_plant_config(motor + effects, "plant.toml").effects;
  Plant plant(c);
  plant.set_excitation({60.0, 1.0, true, 0.0, 0.0});
  std::vector<double> values;
  for (int k = 0; k < 5000; ++k) {
    const RawSample raw = plant.step(Supply{60.0, 150.0}.at(plant));
    const Observed& now = plant.state();
    values.insert(values.end(), {now.i_s.real(), now.psi_r.imag(), now.speed_rpm, now.torque_Nm,
                                 static_cast<double>(raw.stator_C), static_cast<double>(raw.i[0])});
  }
  return values;
}

TEST(LossesAndHeat, LeaveTheBaseMachineBitForBitWhenNeutral) {
  for (const auto kind : {IntegratorConfig::Kind::kSundials, IntegratorConfig::Kind::kRk4}) {
    const auto base = trace("", kind);
    for (const char* name : {"thermal", "windage", "stray_load_loss", "iron_loss", "rotor_skin_effect"})
      EXPECT_EQ(base, trace("[effects." + std::string(name) + "]\n", kind)) << name;
  }
}

}  // namespace
}  // namespace imrig::plant
