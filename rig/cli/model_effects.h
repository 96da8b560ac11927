#pragma once
// imrig model effects | add | remove | history: the effects of a model by hand.

#include <CLI/CLI.hpp>

namespace imrig {

void add_model_effects(CLI::App& model, int& exit_code);

}  // namespace imrig
