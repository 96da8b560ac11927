#include "estimators/model/effects/registry.h"

#include <algorithm>

#include "rig/base/error.h"

namespace imrig::est {

std::optional<std::size_t> effect_number(const std::string& name) {
  for (std::size_t k = 0; k < kEffects; ++k) {
    if (name == kEffectInfos[k].name) return k;
  }
  return std::nullopt;
}

std::size_t effect_of_shared(std::size_t entry) {
  std::size_t k = 0;
  while (kSharedPlace[k + 1] <= entry) ++k;
  return k;
}

const EffectParameter& shared_parameter(std::size_t entry) {
  const std::size_t k = effect_of_shared(entry);
  return kEffectInfos[k].shared[entry - kSharedPlace[k]];
}

const EffectParameter& local_parameter(std::size_t entry) {
  std::size_t k = 0;
  while (kLocalPlace[k + 1] <= entry) ++k;
  return kEffectInfos[k].local[entry - kLocalPlace[k]];
}

std::string shared_name(std::size_t entry) {
  if (entry < kBase) return base_parameters()[entry].name;
  return std::string(kEffectInfos[effect_of_shared(entry)].name) + "." + shared_parameter(entry).name;
}

namespace {

void put(const Model& model, const ActiveEffect& effect, SharedVector<double>& out) {
  const auto number = effect_number(effect.name);
  if (!number)
    throw Error("model \"" + model.name + "\"", "has the effect \"" + effect.name + "\"",
                "imrig model effects lists those there are");
  for (const auto& [name, parameter] : effect.parameters) {
    const auto list = kEffectInfos[*number].shared;
    const auto found =
        std::find_if(list.begin(), list.end(), [&](const EffectParameter& p) { return name == p.name; });
    if (found == list.end()) throw Error("effect " + effect.name, "has no parameter \"" + name + "\"");
    out[kSharedPlace[*number] + static_cast<std::size_t>(found - list.begin())] = parameter.value;
  }
}

}  // namespace

SharedVector<double> shared_vector(const Model& model) {
  const MachineParameters<double> base = model.machine();
  SharedVector<double> out{base.R_s, base.R_r, base.L_l, base.L_m};
  for (std::size_t entry = kBase; entry < kShared; ++entry) out[entry] = shared_parameter(entry).neutral;
  for (const ActiveEffect& effect : model.corrections) put(model, effect, out);
  for (const ActiveEffect& effect : model.effects) put(model, effect, out);
  return out;
}

LocalVector<double> neutral_local() {
  LocalVector<double> out{};
  for (std::size_t entry = kStates; entry < kLocal; ++entry) out[entry] = local_parameter(entry).neutral;
  return out;
}

}  // namespace imrig::est
