// The load generator against the steady state of its circuit, at the speed the plant runs at.

#include <gtest/gtest.h>

#include "plant/powers.h"
#include "tests/plant/bench.h"

namespace imrig::plant {
namespace {

using namespace bench;

struct Steady {
  double torque, current;
};

Steady expected(const GeneratorConfig& g, double w_mech, double field_A) {
  const double w = g.pole_pairs * w_mech, E = w * g.flux_per_field_A_Wb * field_A;
  const double R = g.R_a_ohm + g.R_load_ohm, Z2 = R * R + w * w * g.L_s_H * g.L_s_H;
  return {1.5 * E * E * R / (Z2 * w_mech), E / std::sqrt(Z2)};
}

Plant loaded(const PlantConfig& c, double field_A, double f_Hz) {
  Plant plant(c);
  plant.set_excitation({60.0, field_A, true, 0.0, 0.0});
  run(plant, {f_Hz, 3.0 * f_Hz, 0.3}, 6.0);
  return plant;
}

TEST(Generator, BrakesWithTheTorqueOfItsLoadedCircuit) {
  for (const double f_Hz : {30.0, 60.0}) {
    for (const double field_A : {0.5, 1.2}) {
      const PlantConfig c = config();
      const Plant plant = loaded(c, field_A, f_Hz);
      const Observed& now = plant.state();
      EXPECT_NEAR(now.field_A, field_A, 1e-4);
      const Steady steady = expected(c.generator, now.w_mech_rad_s, now.field_A);
      EXPECT_NEAR(now.load_Nm, steady.torque, 1e-4 * steady.torque);
      EXPECT_NEAR(std::hypot(now.generator_i_d_A, now.generator_i_q_A), steady.current,
                  1e-4 * steady.current);
    }
  }
}

TEST(Generator, CarriesItsShortCircuitCurrent) {
  PlantConfig c = config();
  c.generator.R_load_ohm = 0.0;
  const Plant plant = loaded(c, 0.8, 60.0);
  const Observed& now = plant.state();
  const Steady steady = expected(c.generator, now.w_mech_rad_s, now.field_A);
  // Nearly all reactance: the current is M i_f / L_s whatever the speed, and lies against the field.
  EXPECT_NEAR(steady.current, c.generator.flux_per_field_A_Wb * now.field_A / c.generator.L_s_H,
              0.01 * steady.current);
  EXPECT_NEAR(std::hypot(now.generator_i_d_A, now.generator_i_q_A), steady.current, 1e-4 * steady.current);
  EXPECT_LT(now.generator_i_d_A, 0.0);
  EXPECT_NEAR(now.load_Nm, steady.torque, 1e-4 * steady.torque);
}

// Armature reaction: the loaded armature's own field lies across and against the field winding's,
//   i_d = -w^2 L M i_f/(R^2 + w^2 L^2),   i_q = -w R M i_f/(R^2 + w^2 L^2).
TEST(Generator, WeakensItsFieldByItsArmatureReaction) {
  PlantConfig c = config();
  c.generator.R_load_ohm = 3.0;
  const Observed now = loaded(c, 0.5, 60.0).state();
  const GeneratorConfig& g = c.generator;
  const double w = g.pole_pairs * now.w_mech_rad_s, R = g.R_a_ohm + g.R_load_ohm, X = w * g.L_s_H;
  const double psi = g.flux_per_field_A_Wb * now.field_A, i_d = -w * X * psi / (R * R + X * X);
  EXPECT_NEAR(now.generator_i_d_A, i_d, 2e-4 * std::abs(i_d));
  EXPECT_NEAR(now.generator_i_q_A, i_d * R / X, 2e-4 * std::abs(i_d * R / X));
  EXPECT_LT(g.L_s_H * i_d, -0.3 * psi);  // a good part of the flux
}

TEST(Generator, TurnsShaftPowerIntoHeatInArmatureAndBox) {
  const PlantConfig c = config();
  const Powers p = loaded(c, 1.2, 60.0).powers();
  EXPECT_GT(p.load_W, 1000.0);
  EXPECT_NEAR(p.generator_shaft_W, p.load_W + p.armature_W, 1e-4 * p.load_W);
  EXPECT_NEAR(p.load_W / p.armature_W, c.generator.R_load_ohm / c.generator.R_a_ohm, 1e-9);
}

TEST(Generator, DoesNotBrakeUnexcitedOrUncoupled) {
  EXPECT_EQ(loaded(config(), 0.0, 60.0).state().load_Nm, 0.0);
  PlantConfig c = config();
  c.generator.coupled = false;
  const Plant plant = loaded(c, 1.2, 60.0);
  EXPECT_EQ(plant.state().load_Nm, 0.0);
  EXPECT_NEAR(plant.state().field_A, 1.2, 1e-4);
}

// With the shaft at rest the field is an RL circuit coupled to the closed, resistive armature; slowly seen,
// its time constant is L_f/R_f plus what the armature adds, (3/2) M^2/L_s over R: compare after a long and
// exactly known time with the linear 2x2 system.
TEST(Generator, BuildsItsFieldUpWithTheTimeConstantsOfTheCoupledWindings) {
  PlantConfig c = config();
  c.mechanics.locked = true;
  Plant plant(c);
  plant.set_excitation({20.0, 6.0, true, 0.0, 0.0});
  const GeneratorConfig& g = c.generator;
  // Backward integration free of the plant's code: small explicit steps of L di/dt = v - R i.
  const double R = g.R_a_ohm + g.R_load_ohm,
               D = g.L_s_H * g.L_field_H - 1.5 * g.flux_per_field_A_Wb * g.flux_per_field_A_Wb;
  double i_d = 0.0, i_f = 0.0, worst = 0.0;
  for (int k = 0; k < 20000; ++k) {
    plant.step({});
    const double v_f = plant.state().field_V;
    for (int sub = 0; sub < 60; ++sub) {
      const double u_d = -R * i_d, u_f = v_f - g.R_field_ohm * i_f;
      i_d += 1e-6 * (g.L_field_H * u_d - g.flux_per_field_A_Wb * u_f) / D;
      i_f += 1e-6 * (g.L_s_H * u_f - 1.5 * g.flux_per_field_A_Wb * u_d) / D;
    }
    worst = std::max(worst, std::abs(plant.state().field_A - i_f));
  }
  EXPECT_GT(plant.state().field_A, 0.7);
  EXPECT_LT(worst, 1e-4);
}

}  // namespace
}  // namespace imrig::plant
