#pragma once
// The library by name: what command help, model files, diagnosis and docs are made from.

#include <optional>
#include <string>
#include <vector>

#include "estimators/model/effects/effect_list.h"
#include "estimators/model/model.h"

namespace imrig::est {

std::optional<std::size_t> effect_number(const std::string& name);

// "leakage_saturation.exponent", "R_s", ...: of an entry of the shared vector.
std::string shared_name(std::size_t entry);
const EffectParameter& shared_parameter(std::size_t entry);  // entry >= kBase
const EffectParameter& local_parameter(std::size_t entry);   // entry >= kStates
std::size_t effect_of_shared(std::size_t entry);             // entry >= kBase

// The whole vector of a model: base parameters, active effects, neutral values for the rest.
// Throws Error: base parameter not known, effect or parameter not in the library.
SharedVector<double> shared_vector(const Model& model);

// Neutral for every effect, zero flux.
LocalVector<double> neutral_local();

}  // namespace imrig::est
