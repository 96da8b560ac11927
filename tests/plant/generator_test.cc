// The load generator against the steady state of its circuit, at the speed the plant runs at.

#include "plant/generator.h"

#include <gtest/gtest.h>

#include <cstdio>

#include "plant/powers.h"
#include "rig/base/error.h"
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

GeneratorConfig saturated() {
  GeneratorConfig g;
  g.saturated_ratio = 0.1, g.knee_Wb = 0.3, g.softness = 0.4, g.L_leakage_H = 0.0015;
  return g;
}

// The open-circuit characteristic from its definition: the air-gap line, its bend and its final slope.
TEST(Generator, HasTheOpenCircuitCharacteristicOfItsParameters) {
  const GeneratorConfig g = saturated();
  const Generator generator(g);
  const double M = g.flux_per_field_A_Wb;
  EXPECT_NEAR(generator.open_circuit_field_A(0.002), 0.002 / M, 1e-4 * 0.002 / M);
  const double far = 30.0,
               slope = generator.open_circuit_field_A(far + 1.0) - generator.open_circuit_field_A(far);
  EXPECT_NEAR(slope, 10.0 / M, 1e-4 * slope);  // ten times the current for a volt more
  // The final line meets the air-gap line at the knee.
  const double meet = (generator.open_circuit_field_A(far) - far * slope) / (1.0 / M - slope);
  EXPECT_NEAR(meet, g.knee_Wb, 1e-3);
  // Through the fluxes' own solution, at currents that were put in.
  const double L_m = g.L_s_H - g.L_leakage_H, n = M / L_m;
  for (const double psi : {0.05, 0.3, 0.4, 0.6}) {
    const double i_f = generator.open_circuit_field_A(psi);
    const double psi_f = (g.L_field_H - 1.5 * n * M) * i_f + 1.5 * n * psi;
    const Generator::Flow flow = generator.flow(psi, 0.0, psi_f, 100.0, 0.0);
    EXPECT_NEAR(flow.i_d, 0.0, 1e-9);
    EXPECT_EQ(flow.i_q, 0.0);
    EXPECT_NEAR(flow.i_f, i_f, 1e-9);
  }
}

// At the terminals: nearly open, by the volts of a light load; shorted, where the air gap holds no flux to
// saturate, still the straight machine's current.
TEST(Generator, SaturatesWithOpenTerminalsAndNotWithShortedOnes) {
  PlantConfig c = config();
  c.generator = saturated();
  c.generator.R_load_ohm = 60.0;
  c.sample_time_ns = 10'000, c.pwm_time_ns = 240'000;
  c.mechanics.held_speed_rpm = 1500.0;
  const Generator generator(c.generator);
  const double w = c.generator.pole_pairs * rad_s_of_rpm(1500.0);
  for (const double field_A : {0.3, 1.0, 2.5}) {
    Plant plant(c);
    plant.set_excitation({60.0, field_A, true, 0.0, 0.0});
    hold(plant, {}, 6.0);
    const Observed& now = plant.state();
    const double R = c.generator.R_load_ohm + c.generator.R_a_ohm;
    const Complex i(now.generator_i_d_A, now.generator_i_q_A);
    const Complex air_gap = (-R * i / Complex(0.0, w)) - c.generator.L_leakage_H * i;
    // The armature's current, a few per cent of the field's, seen as the field sees it.
    const double n = c.generator.flux_per_field_A_Wb / (c.generator.L_s_H - c.generator.L_leakage_H);
    const double expected = generator.open_circuit_field_A(std::abs(air_gap));
    EXPECT_NEAR(std::abs(now.field_A + i / n), expected, 2e-4 * expected) << field_A;
  }
  c.generator.R_load_ohm = 0.0;
  Plant shorted(c);
  shorted.set_excitation({60.0, 0.8, true, 0.0, 0.0});
  hold(shorted, {}, 6.0);
  GeneratorConfig straight = c.generator;
  straight.saturated_ratio = 1.0;
  const Steady steady = expected(straight, rad_s_of_rpm(1500.0), shorted.state().field_A);
  EXPECT_NEAR(std::hypot(shorted.state().generator_i_d_A, shorted.state().generator_i_q_A), steady.current,
              0.01 * steady.current);
}

// IEEE 115's segregation: driven unexcited it shows friction and windage; excited, with open terminals, the
// core loss on top, as the square of the voltage and by its two powers of the speed.
TEST(Generator, ShowsItsRotationalLossesToTheShaftThatDrivesIt) {
  for (const double rpm : {900.0, 1800.0}) {
    PlantConfig c = config();
    c.generator.core_loss_W = 120.0, c.generator.core_psi_Wb = 0.4, c.generator.core_rpm = 1800.0;
    c.generator.core_eddy_share = 0.6;
    c.generator.friction_Nm = 0.3, c.generator.windage_Nms2 = 2e-6;
    c.mechanics.held_speed_rpm = rpm;
    const double w = rad_s_of_rpm(rpm), n = rpm / 1800.0;
    Plant cold(c);
    hold(cold, {}, 0.1);
    const Powers bare = cold.powers();
    EXPECT_NEAR(bare.generator_shaft_W, 0.3 * w + 2e-6 * w * w * w, 1e-4 * bare.generator_shaft_W);
    EXPECT_EQ(bare.generator_core_W, 0.0);
    EXPECT_EQ(bare.generator_shaft_W, bare.generator_friction_W);
    Plant excited(c);
    excited.set_excitation({60.0, 1.0, true, 0.0, 0.0});
    hold(excited, {}, 6.0);
    const Powers p = excited.powers();
    const Observed& now = excited.state();
    const Complex i(now.generator_i_d_A, now.generator_i_q_A);
    const double R = c.generator.R_load_ohm + c.generator.R_a_ohm, w_e = c.generator.pole_pairs * w;
    const double psi = std::abs(-R * i / Complex(0.0, w_e) - c.generator.L_leakage_H * i);
    const double core_W = 120.0 * (psi / 0.4) * (psi / 0.4) * (0.4 * n + 0.6 * n * n);
    EXPECT_NEAR(p.generator_core_W, core_W, 1e-3 * core_W) << rpm;
    EXPECT_NEAR(p.generator_shaft_W, p.load_W + p.armature_W + p.generator_core_W + p.generator_friction_W,
                1e-4 * p.generator_shaft_W);
  }
}

// A start-up under load with all of it: what came in is heat, motion and magnetism.
TEST(Generator, SaturatedAndLossyMakesNoEnergy) {
  PlantConfig c = config();
  c.generator = saturated();
  c.generator.core_loss_W = 120.0, c.generator.friction_Nm = 0.3, c.generator.windage_Nms2 = 2e-6;
  c.sample_time_ns = 10'000, c.pwm_time_ns = 240'000;
  Plant plant(c);
  plant.set_excitation({60.0, 2.0, true, 0.0, 0.0});
  const Supply supply{60.0, 179.6, 0.05};
  const double h = sample_s(plant);
  const auto heat_W = [](const Powers& p) {
    return p.stator_copper_W + p.rotor_copper_W + p.iron_W + p.stray_W + p.friction_W + p.armature_W +
           p.generator_core_W + p.generator_friction_W + p.field_copper_W + p.load_W;
  };
  double in_J = 0.0, heat_J = 0.0, core_J = 0.0;
  Powers last = plant.powers();
  Observed before = plant.state();
  while (plant.index() < 150000) {
    plant.step(supply.at(plant));
    const Observed& now = plant.state();
    in_J += h * (power_W(now.v_s, 0.5 * (now.i_s + before.i_s)) +
                 now.field_V * 0.5 * (now.field_A + before.field_A));
    const Powers p = plant.powers();
    heat_J += 0.5 * h * (heat_W(p) + heat_W(last));
    core_J += 0.5 * h * (p.generator_core_W + last.generator_core_W);
    last = p, before = now;
  }
  const double left_J = in_J - heat_J - last.magnetic_J - last.kinetic_J - last.generator_J;
  std::printf("saturated, lossy generator: in %.1f J, core %.1f, stored in it %.1f, left over %.1e of it\n",
              in_J, core_J, last.generator_J, left_J / in_J);
  EXPECT_GT(core_J, 20.0);
  EXPECT_GT(last.generator_J, 5.0);
  EXPECT_NEAR(left_J, 0.0, 3e-5 * in_J);
}

// saturated_ratio 1 and no losses are the straight machine, whatever the other settings: every bit.
TEST(Generator, IsTheStraightMachineWhenNeutral) {
  PlantConfig other = config();
  other.generator.knee_Wb = 0.1, other.generator.softness = 0.9, other.generator.core_psi_Wb = 0.2;
  other.generator.core_eddy_share = 0.1, other.generator.core_rpm = 700.0, other.generator.L_leakage_H = 1e-4;
  const Observed a = loaded(config(), 1.2, 60.0).state(), b = loaded(other, 1.2, 60.0).state();
  EXPECT_EQ(a.generator_i_d_A, b.generator_i_d_A);
  EXPECT_EQ(a.field_A, b.field_A);
  EXPECT_EQ(a.load_Nm, b.load_Nm);
  EXPECT_EQ(a.w_mech_rad_s, b.w_mech_rad_s);
  EXPECT_EQ(a.i_s, b.i_s);
}

// A knee that the flux does not reach, or a ratio next to 1, goes over into the straight machine.
TEST(Generator, GoesOverIntoTheStraightMachine) {
  PlantConfig far = config(), weak = config();
  far.generator.saturated_ratio = 0.5, far.generator.knee_Wb = 500.0;
  weak.generator.saturated_ratio = 1.0 - 1e-7;
  const Observed straight = loaded(config(), 1.2, 60.0).state();
  for (const PlantConfig& c : {far, weak}) {
    const Observed bent = loaded(c, 1.2, 60.0).state();
    EXPECT_NEAR(bent.load_Nm, straight.load_Nm, 1e-5 * straight.load_Nm);
    EXPECT_NEAR(bent.field_A, straight.field_A, 1e-6);
  }
}

TEST(Generator, ChangesNothingThatMattersAtATighterTolerance) {
  const auto at = [](double rtol) {
    PlantConfig c = config();
    c.generator = saturated();
    c.generator.core_loss_W = 120.0, c.generator.friction_Nm = 0.3;
    c.integrator.rtol = rtol;
    return loaded(c, 1.2, 60.0).state();
  };
  const Observed coarse = at(1e-8), fine = at(5e-9);
  EXPECT_NEAR(coarse.load_Nm, fine.load_Nm, 1e-6);
  EXPECT_NEAR(coarse.field_A, fine.field_A, 1e-8);
  EXPECT_LT(std::abs(coarse.i_s - fine.i_s), 1e-6);
}

TEST(Generator, WithoutFieldLeakageIsRefused) {
  PlantConfig c = config();
  c.generator.saturated_ratio = 0.5, c.generator.L_leakage_H = 0.003;
  EXPECT_THROW(Plant{c}, Error);
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
