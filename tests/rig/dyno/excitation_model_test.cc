#include "rig/dyno/excitation_model.h"

#include <gtest/gtest.h>

#include <complex>

#include "rig/base/generator.h"
#include "rig/base/space_vector.h"

namespace imrig {
namespace {

// The power that the phasor diagram gives, over the shaft's speed: current E/Z through the resistances.
double torque_of_phasors_Nm(const GeneratorConfig& g, double rpm, double field_A) {
  const double w_M = rad_s_of_rpm(rpm);
  const double w = g.pole_pairs * w_M;
  const std::complex<double> E(0.0, w * g.flux_per_field_A_Wb * field_A);
  const std::complex<double> I = E / std::complex<double>(g.R_a_ohm + g.R_load_ohm, w * g.L_s_H);
  return 1.5 * (E * std::conj(I)).real() / w_M;
}

TEST(ExcitationModel, TorqueIsThePowerOfThePhasorsOverTheSpeed) {
  const GeneratorConfig g;
  for (const double rpm : {100.0, 900.0, 1750.0, 2400.0}) {
    EXPECT_NEAR(shaft_torque_Nm(g, rad_s_of_rpm(rpm), 1.7), torque_of_phasors_Nm(g, rpm, 1.7), 1e-9);
    EXPECT_NEAR(shaft_torque_Nm(g, rad_s_of_rpm(-rpm), 1.7), torque_of_phasors_Nm(g, rpm, 1.7), 1e-9);
  }
}

TEST(ExcitationModel, TheFieldCurrentForATorqueGivesThatTorque) {
  const GeneratorConfig g;
  for (const double rpm : {-1500.0, 300.0, 900.0, 1750.0}) {
    for (const double torque : {0.0, 0.5, 5.0, 20.0}) {
      const double field_A = field_A_for_load(g, rpm, torque, 100.0);
      EXPECT_NEAR(torque_of_phasors_Nm(g, std::abs(rpm), field_A), torque, 1e-9);
    }
  }
}

TEST(ExcitationModel, TheFieldCurrentIsHeldToTheMostAlsoAtStandstill) {
  const GeneratorConfig g;
  EXPECT_EQ(field_A_for_load(g, 1500.0, 1e6, 3.0), 3.0);
  EXPECT_EQ(field_A_for_load(g, 0.0, 1.0, 3.0), 3.0);
  EXPECT_EQ(field_A_for_load(g, 0.0, 0.0, 3.0), 0.0);
}

TEST(ExcitationModel, TheGreatestTorqueIsTheMaximumOverSpeed) {
  const GeneratorConfig g;
  double greatest = 0.0;
  for (double rpm = 1.0; rpm < 20000.0; rpm += 1.0)
    greatest = std::max(greatest, torque_of_phasors_Nm(g, rpm, 2.0));
  EXPECT_NEAR(greatest_torque_Nm(g, 2.0), greatest, 1e-4 * greatest);
}

}  // namespace
}  // namespace imrig
