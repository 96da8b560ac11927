#pragma once
// What the maps add to `imrig identify --json`: keys correlation, maps, losses, locked, sensitivity, validation.

#include <string>

#include "estimators/fit/maps/identify_maps.h"

namespace imrig::est {

// The JSON of identify_json.h with the keys above where something was mapped. docs/identification.md.
std::string to_json(const MapsResult& result);

}  // namespace imrig::est
