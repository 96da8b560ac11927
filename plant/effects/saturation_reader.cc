#include "plant/effects/saturation_reader.h"

#include "plant/effects/cross_saturation.h"
#include "plant/effects/leakage_saturation.h"
#include "plant/effects/magnetizing_saturation.h"
#include "rig/base/config_reader.h"

namespace imrig::plant {
namespace {

constexpr Range kRatio{0.02, 1.0};
constexpr Range kFlux_Wb{1e-3, 1e3};
constexpr Range kCurrent_A{1e-2, 1e5};
constexpr Range kSoftness{0.05, 0.95};

// Defaults: knees of the 5 hp motor (0.48 Wb and 14.8 A peak rated).
SaturationLaw flux_law(const ConfigReader& table) {
  return {table.number_or("saturated_ratio", 1.0, kRatio), table.number_or("knee_Wb", 0.5, kFlux_Wb),
          table.number_or("softness", 0.4, kSoftness)};
}

}  // namespace

std::shared_ptr<const Effect> read_magnetizing_saturation(const ConfigReader& table) {
  return std::make_shared<MagnetizingSaturation>(flux_law(table));
}

std::shared_ptr<const Effect> read_leakage_saturation(const ConfigReader& table) {
  const double softness = table.number_or("softness", 0.4, kSoftness);
  return std::make_shared<LeakageSaturation>(
      SaturationLaw{table.number_or("stator_saturated_ratio", 1.0, kRatio),
                    table.number_or("stator_knee_A", 40.0, kCurrent_A), softness},
      SaturationLaw{table.number_or("rotor_saturated_ratio", 1.0, kRatio),
                    table.number_or("rotor_knee_A", 40.0, kCurrent_A), softness});
}

std::shared_ptr<const Effect> read_cross_saturation(const ConfigReader& table) {
  const SaturationLaw teeth = flux_law(table);
  return std::make_shared<CrossSaturation>(teeth, table.number_or("leakage_share", 0.5, {0.0, 1.0}));
}

}  // namespace imrig::plant
