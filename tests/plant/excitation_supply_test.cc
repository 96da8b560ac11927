#include "plant/excitation_supply.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/plant/bench.h"

namespace imrig::plant {
namespace {

using namespace bench;

constexpr double kPeriod_s = 240e-6;

// A field that is a plain RL circuit.
struct Field {
  double R = 20.0, L = 5.0, i = 0.0;
  void carry(ExcitationSupply& supply, double duration_s) {
    for (double t = 0.0; t < duration_s; t += kPeriod_s)
      i += kPeriod_s / L * (supply.update(i, kPeriod_s) - R * i);
  }
};

TEST(ExcitationSupply, HoldsItsVoltageWhileTheCurrentStaysBelowItsLimit) {
  ExcitationSupply supply{SupplyConfig{}};
  supply.set({30.0, 3.0, true, 0.0, 0.0});
  Field field;
  field.carry(supply, 5.0);
  EXPECT_DOUBLE_EQ(supply.readback().V, 30.0);
  EXPECT_NEAR(supply.readback().A, 1.5, 1e-6);
  EXPECT_FALSE(supply.readback().constant_current);
  EXPECT_TRUE(supply.readback().output_on);
}

TEST(ExcitationSupply, CrossesOverToConstantCurrentAndBack) {
  ExcitationSupply supply{SupplyConfig{}};
  supply.set({60.0, 1.0, true, 0.0, 0.0});
  Field field;
  field.carry(supply, 5.0);
  EXPECT_TRUE(supply.readback().constant_current);
  EXPECT_NEAR(supply.readback().A, 1.0, 1e-6);
  EXPECT_NEAR(supply.readback().V, 20.0, 1e-3);
  supply.set({10.0, 1.0, true, 0.0, 0.0});
  field.carry(supply, 5.0);
  EXPECT_FALSE(supply.readback().constant_current);
  EXPECT_NEAR(supply.readback().A, 0.5, 1e-6);
}

TEST(ExcitationSupply, RampsItsVoltageNoFasterThanItsSlewRate) {
  SupplyConfig config;
  config.slew_V_per_s = 100.0;
  ExcitationSupply supply(config);
  supply.set({20.0, 6.0, true, 0.0, 0.0});
  Field field;
  field.carry(supply, 0.1);
  EXPECT_NEAR(supply.output_V(), 10.0, 0.05);
  field.carry(supply, 0.2);
  EXPECT_DOUBLE_EQ(supply.output_V(), 20.0);
}

TEST(ExcitationSupply, TripsOnOverVoltageAndStaysOffUntilSwitchedOff) {
  ExcitationSupply supply{SupplyConfig{}};
  Field field;
  supply.set({40.0, 6.0, true, 30.0, 0.0});
  field.carry(supply, 1.0);
  EXPECT_TRUE(supply.readback().tripped_ovp);
  EXPECT_FALSE(supply.readback().output_on);
  EXPECT_EQ(supply.output_V(), 0.0);
  supply.set({20.0, 6.0, true, 30.0, 0.0});  // a lower set-point alone does not bring it back
  field.carry(supply, 1.0);
  EXPECT_EQ(supply.output_V(), 0.0);
  supply.set({20.0, 6.0, false, 30.0, 0.0});
  field.carry(supply, 0.01);
  EXPECT_FALSE(supply.readback().tripped_ovp);
  supply.set({20.0, 6.0, true, 30.0, 0.0});
  field.carry(supply, 1.0);
  EXPECT_EQ(supply.output_V(), 20.0);
}

TEST(ExcitationSupply, TripsOnOverCurrent) {
  ExcitationSupply supply{SupplyConfig{}};
  Field field;
  supply.set({40.0, 6.0, true, 0.0, 1.5});
  field.carry(supply, 2.0);
  EXPECT_TRUE(supply.readback().tripped_ocp);
  EXPECT_FALSE(supply.readback().tripped_ovp);
  EXPECT_EQ(supply.output_V(), 0.0);
  EXPECT_LT(field.i, 1.5);
}

TEST(ExcitationSupply, TakesNonsenseSetPointsAsZeroAndKeepsItsRatings) {
  ExcitationSupply supply{SupplyConfig{}};
  Field field;
  supply.set({NAN, 1.0, true, 0.0, 0.0});
  field.carry(supply, 0.5);
  EXPECT_EQ(supply.output_V(), 0.0);
  supply.set({1e9, 1e9, true, 0.0, 0.0});
  field.carry(supply, 2.0);
  EXPECT_EQ(supply.output_V(), 60.0);
}

TEST(ExcitationSupply, SettlesTheFieldOfTheRunningGeneratorWithoutMuchOvershoot) {
  Plant plant(config());
  const Supply line{60.0, 179.6, 0.3};
  run(plant, line, 1.5);
  plant.set_excitation({60.0, 1.0, true, 0.0, 0.0});
  double most = 0.0;
  const auto end = plant.index() + 16667;
  while (plant.index() < end) {
    plant.step(line.at(plant));
    most = std::max(most, plant.state().field_A);
  }
  EXPECT_LT(most, 1.05);
  EXPECT_NEAR(plant.state().field_A, 1.0, 0.002);
  EXPECT_TRUE(plant.excitation().constant_current);
}

}  // namespace
}  // namespace imrig::plant
