#include "estimators/model/effects/effect_file.h"

#include <fmt/format.h>

#include <algorithm>

#include "estimators/model/effects/registry.h"

namespace imrig::est {

namespace {

std::string names_of_effects() {
  std::string out;
  for (const EffectInfo& info : kEffectInfos) out += (out.empty() ? "" : ", ") + std::string(info.name);
  return out;
}

void check_form(const ConfigReader& table, const ActiveEffect& effect, const EffectInfo& info) {
  if (effect.form.empty()) return;
  const auto known = std::any_of(info.forms.begin(), info.forms.end(),
                                 [&](const EffectForm& f) { return effect.form == f.name; });
  if (known) return;
  std::string forms;
  for (const EffectForm& f : info.forms) forms += (forms.empty() ? "" : ", ") + std::string(f.name);
  table.fail("form", "is \"" + effect.form + "\"", fmt::format("{} has the forms {}", effect.name, forms));
}

// The bounds of a search, and the values at which plainer forms hold a shape.
Range range_of(const EffectParameter& p) {
  Range range{std::min(p.low, p.neutral), std::max(p.high, p.neutral)};
  for (const double x : p.scan) range = {std::min(range.low, x), std::max(range.high, x)};
  return range;
}

// Shapes that this library had before: read where they were without effect.
struct Retired {
  const char* effect;
  const char* parameter;
};
constexpr Retired kRetired[] = {{"magnetizing_saturation", "settling"},
                                {"leakage_saturation", "settling"},
                                {"leakage_saturation", "place"}};

void check_retired(const ConfigReader& parameters, const ActiveEffect& effect,
                   ParameterReader read_parameter) {
  for (const Retired& old : kRetired) {
    if (effect.name != old.effect) continue;
    const auto one = parameters.table_if(old.parameter);
    if (!one || read_parameter(*one, {0.0, 50.0}).value == 0.0) continue;
    parameters.fail(
        old.parameter, "is of a law that this imrig does not know any more",
        fmt::format("delete this [[effect]] from the file, then: imrig model add FILE {}", effect.name));
  }
}

}  // namespace

ActiveEffect read_effect(const ConfigReader& table, ParameterReader read_parameter) {
  ActiveEffect effect;
  effect.name = table.text("name");
  const auto number = effect_number(effect.name);
  if (!number)
    table.fail("name", "is the effect \"" + effect.name + "\", which this imrig does not know",
               "it knows " + names_of_effects());
  const EffectInfo& info = kEffectInfos[*number];
  effect.form = table.text_or("form", "");
  check_form(table, effect, info);
  const auto parameters = table.table_if("parameters");
  if (!parameters) return effect;
  check_retired(*parameters, effect, read_parameter);
  for (const EffectParameter& p : info.shared) {
    const auto one = parameters->table_if(p.name);
    if (!one) continue;
    effect.parameters[p.name] = read_parameter(*one, range_of(p));
    if (effect.parameters[p.name].unit != p.unit)
      one->fail("unit", "is not right here", fmt::format("it must be \"{}\"", p.unit));
  }
  return effect;
}

}  // namespace imrig::est
