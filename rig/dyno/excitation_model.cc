#include "rig/dyno/excitation_model.h"

#include <algorithm>

#include "rig/base/generator.h"
#include "rig/base/space_vector.h"

namespace imrig {

double greatest_torque_Nm(const GeneratorConfig& generator, double field_A) {
  const double flux_Wb = generator.flux_per_field_A_Wb * field_A;
  return 0.75 * generator.pole_pairs * flux_Wb * flux_Wb / generator.L_s_H;
}

double field_A_for_load(const GeneratorConfig& generator, double speed_rpm, double torque_Nm, double most_A) {
  return std::min(field_A_for_torque(generator, rad_s_of_rpm(speed_rpm), torque_Nm), most_A);
}

}  // namespace imrig
