// Gates off: the diodes drive the currents to zero, the open motor decays, and nothing gains energy.

#include <gtest/gtest.h>

#include <memory>

#include "plant/diode_bridge.h"
#include "plant/powers.h"
#include "tests/plant/bench.h"

namespace imrig::plant {
namespace {

using namespace bench;

constexpr InverterCommand kOff{};

double stored_J(const Plant& plant) {
  const Powers p = plant.powers();
  return p.magnetic_J + p.kinetic_J + p.generator_J;
}

TEST(Freewheel, DrivesADirectCurrentToZeroInTheTimeTheLinkNeeds) {
  PlantConfig c = config();
  c.mechanics.locked = true;
  Plant plant(c);
  hold(plant, command(4.0), 2.0);
  const double i_0 = plant.state().i_s.real();
  int samples = 0;
  while (plant.state().i_s != Complex(0.0)) {
    plant.step(kOff);
    ++samples;
    ASSERT_LT(samples, 100);
  }
  // Phase a hangs on the lower rail, b and c on the upper: -2/3 of the link along the current's axis, against
  // the rotor's flux that keeps it up.
  const double time_s = kLl * i_0 / (2.0 / 3.0 * 400.0);
  EXPECT_NEAR(samples * 60e-6, time_s, 0.05 * time_s + 60e-6);
}

TEST(Freewheel, LeavesTheOpenRotorToItsOwnTimeConstant) {
  PlantConfig c = config();
  c.mechanics.locked = true;
  Plant plant(c);
  hold(plant, command(4.0), 3.0);
  hold(plant, kOff, 0.01);
  ASSERT_EQ(plant.state().i_s, Complex(0.0));
  const double psi_0 = std::abs(plant.state().psi_r);
  const double t = 0.3;
  hold(plant, kOff, t);
  EXPECT_NEAR(std::abs(plant.state().psi_r) / psi_0, std::exp(-t * kRr / kLm), 1e-9);
}

TEST(Freewheel, ShowsTheBackEmfOfTheDecayingRotor) {
  PlantConfig c = config();
  c.mechanics.J_kgm2 = 50.0;  // the speed hardly moves while the flux decays
  c.generator.coupled = false;
  Plant plant(c);
  run(plant, {10.0, 60.0}, 60.0);
  const double w = kPolePairs * plant.state().w_mech_rad_s;
  ASSERT_GT(w, 50.0);
  hold(plant, kOff, 0.02);
  ASSERT_EQ(plant.state().i_s, Complex(0.0));
  for (int k = 0; k < 20; ++k) {
    const Complex psi =
        plant.state().psi_s;  // with open terminals this is the rotor flux of the inverse-gamma circuit
    const Complex emf = Complex(-kRr / kLm, w) * psi;
    ASSERT_LT(std::abs(plant.state().v_s - emf), 1e-3 * std::abs(emf));
    const double amplitude = std::abs(psi);
    hold(plant, kOff, 0.012);
    ASSERT_NEAR(std::abs(plant.state().psi_s) / amplitude, std::exp(-0.012 * kRr / kLm), 1e-9);
  }
}

// A running, loaded motor whose gates open at every angle of the supply.
class FreewheelAtAnyAngle : public testing::TestWithParam<int> {};

TEST_P(FreewheelAtAnyAngle, EndsAtZeroGainsNothingAndStartsAgainSmoothly) {
  Plant plant(config());
  plant.set_excitation({60.0, 1.2, true, 0.0, 0.0});
  const Supply supply{60.0, 179.6, 0.1};
  run(plant, supply, 1.2);
  plant.set_excitation({});
  run(plant, supply, 0.03 + GetParam() * 11 * 60e-6);
  ASSERT_GT(std::abs(plant.state().i_s), 5.0);
  Complex psi_s = plant.state().psi_s;
  double before_J = stored_J(plant);
  int samples_to_zero = 0, restarts = 0;
  bool was_zero = false;
  for (int k = 0; k < 2000; ++k) {
    plant.step(kOff);
    const Observed& now = plant.state();
    ASSERT_LE(stored_J(plant), before_J * (1.0 + 1e-12)) << k;
    ASSERT_LE(plant.powers().motor_W, 1e-6) << k;
    ASSERT_LT(std::abs(now.psi_s - psi_s), 60e-6 * 280.0) << k;  // no voltage above 2/3 of the link
    before_J = stored_J(plant);
    psi_s = now.psi_s;
    const bool zero = now.i_s == Complex(0.0);
    if (!zero && !was_zero) ++samples_to_zero;
    if (!zero && was_zero) ++restarts;
    was_zero = zero;
  }
  EXPECT_TRUE(was_zero);
  EXPECT_EQ(restarts, 0);
  EXPECT_LT(samples_to_zero, 60);
  // Closing the gates on the running motor: fluxes go on from where they are.
  plant.step(command(plant.state().v_s));
  EXPECT_LT(std::abs(plant.state().i_s), 0.1);
}

INSTANTIATE_TEST_SUITE_P(Angles, FreewheelAtAnyAngle, testing::Range(0, 25));

TEST(Freewheel, BlocksTheSmallestPhaseFirstAndKeepsItsCurrentAtZero) {
  PlantConfig c = config();
  c.mechanics.locked = true;
  Plant plant(c);
  hold(plant, command(space_vector(4.0, -3.2, -0.8)), 2.0);
  bool pair_seen = false;
  for (int k = 0; k < 40; ++k) {
    plant.step(kOff);
    const auto i = phases(plant.state().i_s);
    if (std::abs(i[2]) < 1e-12 && std::abs(i[0]) > 0.1) {
      pair_seen = true;
      EXPECT_NEAR(i[0], -i[1], 1e-12);
    }
  }
  EXPECT_TRUE(pair_seen);
  EXPECT_EQ(plant.state().i_s, Complex(0.0));
}

TEST(DiodeBridge, RectifiesAnEmfAboveTheLink) {
  DiodeBridge bridge(400.0);
  EXPECT_FALSE(bridge.conduct_where_forced(space_vector(199.0, -199.0, 0.0)));
  EXPECT_TRUE(bridge.conduct_where_forced(space_vector(10.0, -210.0, 200.0)));
  // b pulls current out of the lower rail, c pushes it into the upper one: the pair sees the whole link.
  const Terminals pair = bridge.terminals();
  EXPECT_EQ(pair.kind, Terminals::Kind::kPair);
  EXPECT_EQ(pair.axis, DiodeBridge::axis(0));
  const auto v = phases(pair.v_s);
  EXPECT_NEAR(v[2] - v[1], 400.0, 1e-9);
  EXPECT_TRUE(bridge.reversed(1, -1.0));
  EXPECT_TRUE(bridge.reversed(2, 1.0));
  EXPECT_FALSE(bridge.reversed(1, 1.0));
}

TEST(DiodeBridge, LetsTheFloatingPhaseConductOnlyBeyondTheRails) {
  DiodeBridge bridge(400.0);
  bridge.take_over(space_vector(5.0, -5.0, 0.0));
  ASSERT_EQ(bridge.conducting(), 2);
  EXPECT_FALSE(
      bridge.conduct_where_forced(space_vector(-166.0, 34.0, 132.0)));  // 1.5 x 132 V is within 200 V
  EXPECT_TRUE(bridge.conduct_where_forced(space_vector(-167.0, 33.0, 134.0)));
  EXPECT_EQ(bridge.conducting(), 3);
}

}  // namespace
}  // namespace imrig::plant
