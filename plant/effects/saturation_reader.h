#pragma once
// The three kinds of saturation from their tables.

#include <memory>

#include "plant/effects/effect.h"

namespace imrig {
class ConfigReader;
}

namespace imrig::plant {

std::shared_ptr<const Effect> read_magnetizing_saturation(const ConfigReader& table);
std::shared_ptr<const Effect> read_leakage_saturation(const ConfigReader& table);
std::shared_ptr<const Effect> read_cross_saturation(const ConfigReader& table);

}  // namespace imrig::plant
