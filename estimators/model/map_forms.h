#pragma once
// The maps a model file may hold under [maps.NAME.PARAMETER]: parameters of the circuit, and losses, as functions
// of operating conditions, in the forms of Proca and Keyhani 2002. docs/model-file.md lists them.

#include <vector>

namespace imrig::est {

struct MapParameter {
  const char* name;
  const char* unit;
};

struct MapForm {
  const char* name;
  const char* equation;
  std::vector<MapParameter> parameters;
};

// R_s, L_m, L_l, R_r, rotor_bars, core_loss, friction_windage, stray_drag.
const std::vector<MapForm>& map_forms();

}  // namespace imrig::est
