#pragma once
// Model files: TOML, version 1, docs/model-file.md. Strict: an unknown key, an unknown effect, a value out of
// range or another version is an Error that names file, line and key. A saved model is read back to the same
// bits.

#include <string>
#include <string_view>

#include "estimators/model/model.h"

namespace imrig::est {

Model load_model(const std::string& path);
Model parse_model(const std::string& text, const std::string& name);  // name: for messages
std::string to_toml(const Model& model);
void save_model(const Model& model, const std::string& path);  // whole or not at all

}  // namespace imrig::est
