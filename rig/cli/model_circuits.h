#pragma once
// imrig model convert | export: a model file in other circuits, and for other programs.

#include <CLI/CLI.hpp>

namespace imrig {

void add_model_convert(CLI::App& model, int& exit_code);
void add_model_export(CLI::App& model, int& exit_code);

}  // namespace imrig
