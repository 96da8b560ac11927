#pragma once
// Active effects in a model file, checked against the library: names, forms, parameters, units and bounds.
//   [[effect]]
//   name = "core_loss"
//   form = "eddy currents"
//   [effect.parameters.eddy_S]
//   value = 0.0015

#include <string>

#include "estimators/model/model.h"
#include "rig/base/config_reader.h"

namespace imrig::est {

// The reader of one parameter's table, as for base parameters.
using ParameterReader = Parameter (*)(const ConfigReader& table, Range range);

// Throws Error naming file, line and key.
ActiveEffect read_effect(const ConfigReader& table, ParameterReader read_parameter);

}  // namespace imrig::est
