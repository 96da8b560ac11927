#pragma once
// The shipped motor with all effects (saturation of main flux and leakage, deep bars, heat, iron, stray and windage
// losses, dead time), with a cage that warms from 20 C by 100 K within minutes.

#include <fmt/format.h>

#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "rig/base/file.h"

namespace imrig::test {

using Exchange = std::vector<std::pair<std::string, std::string>>;

inline std::string exchanged_text(std::string text, const Exchange& lines) {
  for (const auto& [from, to] : lines) {
    const std::size_t at = text.find(from);
    if (at == std::string::npos) throw std::runtime_error("there is no " + from);
    text.replace(at, from.size(), to);
  }
  return text;
}
// Of a file.
inline std::string exchanged(const std::string& path, const Exchange& lines) { return exchanged_text(read_text(path), lines); }

// root: of the repository.
inline std::string full_plant(const std::string& root, int seed) {
  return exchanged(root + "/models/plants/proca_5hp_full.toml", {{"seed = 1", fmt::format("seed = {}", seed)},
                                                                 {"rotor_J_per_K = 1500.0", "rotor_J_per_K = 230.0"},
                                                                 {"rotor_iron_W_per_K = 10.0", "rotor_iron_W_per_K = 0.2"},
                                                                 {"ambient_C = 25.0", "ambient_C = 20.0"},
                                                                 {"reference_C = 25.0", "reference_C = 20.0"}});
}

}  // namespace imrig::test
