#include "rig/dyno/excitation_model.h"

#include <cmath>

#include "rig/base/space_vector.h"

namespace imrig {

namespace {

// T = torque_factor * w / (R^2 + (w L)^2) with the factor (3/2) p k^2 i_f^2 R.
double torque_factor(const GeneratorConfig& g, double field_A) {
  const double flux_Wb = g.flux_per_field_A_Wb * field_A;
  return 1.5 * g.pole_pairs * flux_Wb * flux_Wb * (g.R_a_ohm + g.R_load_ohm);
}

double electrical_rad_s(const GeneratorConfig& g, double speed_rpm) {
  return std::abs(g.pole_pairs * rad_s_of_rpm(speed_rpm));
}

double torque_per_square_A(const GeneratorConfig& g, double speed_rpm) {
  const double w = electrical_rad_s(g, speed_rpm);
  const double R = g.R_a_ohm + g.R_load_ohm;
  const double X = w * g.L_s_H;
  return torque_factor(g, 1.0) * w / (R * R + X * X);
}

}  // namespace

double generator_torque_Nm(const GeneratorConfig& generator, double speed_rpm, double field_A) {
  return torque_per_square_A(generator, speed_rpm) * field_A * field_A;
}

double field_current_for_torque_A(const GeneratorConfig& generator, double speed_rpm, double torque_Nm) {
  return torque_Nm > 0.0 ? std::sqrt(torque_Nm / torque_per_square_A(generator, speed_rpm)) : 0.0;
}

double greatest_torque_Nm(const GeneratorConfig& generator, double field_A) {
  const double R = generator.R_a_ohm + generator.R_load_ohm;
  return torque_factor(generator, field_A) / (2.0 * R * generator.L_s_H);
}

}  // namespace imrig
