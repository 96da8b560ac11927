// Every joule that enters the plant is heat, motion or magnetism at the end.

#include <gtest/gtest.h>

#include <cstdio>
#include <memory>

#include "plant/effects/friction.h"
#include "plant/powers.h"
#include "tests/plant/bench.h"

namespace imrig::plant {
namespace {

using namespace bench;

TEST(Energy, BalancesOverAStartUpUnderLoad) {
  PlantConfig c = config();
  c.sample_time_ns = 20'000;  // for the sums below: their error goes with its square
  c.pwm_time_ns = 240'000;
  c.effects.push_back(std::make_shared<Friction>(Friction::Config{0.25, 0.0015, 0.2}));
  Plant plant(c);
  plant.set_excitation({60.0, 1.2, true, 0.0, 0.0});
  const Supply supply{60.0, 179.6, 0.05};
  const double h = sample_s(plant);
  double in_J = 0.0, stator_J = 0.0, rotor_J = 0.0, drag_J = 0.0, field_heat_J = 0.0, box_J = 0.0,
         armature_J = 0.0;
  Powers last = plant.powers();
  Complex i_last = plant.state().i_s;
  double field_last = 0.0;
  while (plant.index() < 75000) {
    plant.step(supply.at(plant));
    const Powers now = plant.powers();
    // The voltages are held over the step, so the currents' mean gives the energy.
    in_J += h * (power_W(plant.state().v_s, 0.5 * (plant.state().i_s + i_last)) +
                 plant.state().field_V * 0.5 * (plant.state().field_A + field_last));
    const auto add = [&](double& sum, double Powers::*part) { sum += 0.5 * h * (now.*part + last.*part); };
    add(stator_J, &Powers::stator_copper_W), add(rotor_J, &Powers::rotor_copper_W),
        add(drag_J, &Powers::drag_W);
    add(field_heat_J, &Powers::field_copper_W), add(box_J, &Powers::load_W),
        add(armature_J, &Powers::armature_W);
    last = now;
    i_last = plant.state().i_s;
    field_last = plant.state().field_A;
  }
  const double stored_J = last.magnetic_J + last.kinetic_J + last.generator_J;
  const double out_J = stator_J + rotor_J + drag_J + field_heat_J + box_J + armature_J + stored_J;
  std::printf(
      "in %.3f J = copper %.3f + %.3f, friction %.3f, field %.3f, armature %.3f, box %.3f, magnetic %.3f + "
      "%.3f, kinetic %.3f; left over %.2e of it\n",
      in_J, stator_J, rotor_J, drag_J, field_heat_J, armature_J, box_J, last.magnetic_J, last.generator_J,
      last.kinetic_J, (in_J - out_J) / in_J);
  EXPECT_GT(last.kinetic_J, 700.0);
  EXPECT_GT(box_J, 500.0);
  EXPECT_GT(drag_J, 20.0);
  EXPECT_NEAR(in_J, out_J, 2e-5 * in_J);
}

TEST(Energy, IsLostByARunDownToBearingsGeneratorAndCopperOnly) {
  PlantConfig c = config();
  c.effects.push_back(std::make_shared<Friction>(Friction::Config{0.25, 0.0015, 0.2}));
  Plant plant(c);
  run(plant, {60.0, 179.6, 0.05}, 1.5);
  const InverterCommand off{};
  hold(plant, off, 1.0);
  const double h = sample_s(plant);
  const Powers start = plant.powers();
  double drag_J = 0.0;
  Powers last = start;
  for (int k = 0; k < 20000; ++k) {
    plant.step(off);
    const Powers now = plant.powers();
    drag_J += 0.5 * h * (now.drag_W + last.drag_W);
    last = now;
  }
  // The rotor's flux has died: only friction brakes.
  EXPECT_GT(drag_J, 10.0);
  EXPECT_NEAR(start.kinetic_J - last.kinetic_J, drag_J, 1e-6 * start.kinetic_J + 0.01 * start.magnetic_J);
}

}  // namespace
}  // namespace imrig::plant
