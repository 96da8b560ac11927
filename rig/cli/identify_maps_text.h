#pragma once
// Maps, losses, correlations and validation as `imrig identify` prints them.

#include <string>

#include "estimators/fit/maps/identify_maps.h"

namespace imrig {

// Empty when nothing was mapped.
std::string maps_text(const est::MapsResult& result);

}  // namespace imrig
