#pragma once
// The library of effects, one line each: header above, name below. Places of their parameters in the vectors
// of a motor (shared) and of a record (local) follow from the order.

#include <array>
#include <cstddef>
#include <tuple>
#include <utility>

#include "estimators/model/effects/broken_bar.h"
#include "estimators/model/effects/core_loss.h"
#include "estimators/model/effects/current_gain.h"
#include "estimators/model/effects/current_offset.h"
#include "estimators/model/effects/friction_windage.h"
#include "estimators/model/effects/inverter_dead_time.h"
#include "estimators/model/effects/leakage_saturation.h"
#include "estimators/model/effects/magnetizing_saturation.h"
#include "estimators/model/effects/rotor_heating.h"
#include "estimators/model/effects/rotor_skin_effect.h"
#include "estimators/model/effects/speed_bias.h"
#include "estimators/model/effects/stator_heating.h"
#include "estimators/model/effects/stator_unbalance.h"
#include "estimators/model/effects/stray_load_loss.h"
#include "estimators/model/effects/supply_unbalance.h"
#include "estimators/model/effects/torque_sensor.h"
#include "estimators/model/effects/voltage_lag.h"

namespace imrig::est {

template <class T>
using EffectLaws =
    std::tuple<MagnetizingSaturation<T>, LeakageSaturation<T>, RotorSkinEffect<T>, RotorHeating<T>,
               StatorHeating<T>, CoreLoss<T>, FrictionWindage<T>, StrayLoadLoss<T>, InverterDeadTime<T>,
               VoltageLag<T>, CurrentOffset<T>, CurrentGain<T>, SupplyUnbalance<T>, StatorUnbalance<T>,
               BrokenBar<T>, SpeedBias<T>, TorqueSensor<T>>;

inline constexpr std::size_t kEffects = std::tuple_size_v<EffectLaws<double>>;
inline constexpr std::size_t kBase = 4;  // R_s, R_r, L_l, L_m
inline constexpr std::size_t kStates =
    6;  // of a record: psi_s, psi_r, i_b at its start, real and imaginary parts

template <std::size_t... K>
constexpr std::array<EffectInfo, sizeof...(K)> infos_of(std::index_sequence<K...>) {
  return {std::tuple_element_t<K, EffectLaws<double>>::kInfo...};
}
inline constexpr std::array<EffectInfo, kEffects> kEffectInfos =
    infos_of(std::make_index_sequence<kEffects>());

// Those that may be claimed: corrections are not.
inline constexpr std::size_t kLibrary = [] {
  std::size_t n = 0;
  for (const EffectInfo& info : kEffectInfos) n += info.correction ? 0u : 1u;
  return n;
}();

// First entry of each effect; the last entry is the vector's length.
constexpr std::array<std::size_t, kEffects + 1> places_of(
    std::size_t first, std::span<const EffectParameter> EffectInfo::*list) {
  std::array<std::size_t, kEffects + 1> places{};
  for (std::size_t k = 0; k < kEffects; ++k) {
    places[k] = first;
    first += (kEffectInfos[k].*list).size();
  }
  places[kEffects] = first;
  return places;
}
inline constexpr auto kSharedPlace = places_of(kBase, &EffectInfo::shared);
inline constexpr auto kLocalPlace = places_of(kStates, &EffectInfo::local);
inline constexpr std::size_t kShared = kSharedPlace[kEffects];
inline constexpr std::size_t kLocal = kLocalPlace[kEffects];

template <class T>
using SharedVector = std::array<T, kShared>;
template <class T>
using LocalVector = std::array<T, kLocal>;

}  // namespace imrig::est
