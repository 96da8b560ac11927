#include "estimators/diagnose/missing/working_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "estimators/fit/student_t.h"
#include "estimators/model/effects/registry.h"
#include "rig/base/error.h"

namespace imrig::est {

namespace {

constexpr double kReach = 5.0, kReachOfGuess = 30.0;  // keep_in_reach
constexpr double kOffsetShare = 5e-4;  // of the largest current: no channel is better than that
constexpr double kLagShare = 0.02;     // of a sample: nobody knows what the voltage does between samples

std::size_t entry_named(const char* effect, const char* parameter) {
  const std::size_t k = *effect_number(effect);
  const auto list = kEffectInfos[k].shared;
  const auto found = std::find_if(list.begin(), list.end(),
                                  [&](const auto& p) { return std::string_view(p.name) == parameter; });
  return kSharedPlace[k] + static_cast<std::size_t>(found - list.begin());
}

// The form that an active effect of a model file is in: by name, else the plainest that frees what it holds.
std::size_t form_number(const ActiveEffect& effect, std::size_t number) {
  const auto forms = kEffectInfos[number].forms;
  for (std::size_t k = 0; k < forms.size(); ++k) {
    if (effect.form == forms[k].name) return k;
  }
  if (!effect.form.empty())
    throw Error("effect " + effect.name, "has no form \"" + effect.form + "\"",
                "imrig model effects lists the forms");
  return 0;
}

// Errors of the sensors that the data set admits to: free inside their accuracy, so that they never come out
// as physics. Three independent gain errors of sigma make a negative sequence of sigma/sqrt(6) a component.
void admit(const char* effect, double sigma, WorkingModel& out) {
  const std::size_t number = *effect_number(effect);
  if (!(sigma > 0.0) || out.has(number)) return;
  for (std::size_t e = kSharedPlace[number]; e < kSharedPlace[number + 1]; ++e) {
    if (shared_parameter(e).role != Role::kAmplitude) continue;
    out.nuisances.push_back(e);
    out.priors.push_back({e, shared_parameter(e).neutral, sigma});
  }
}

// Errors of the transducer beside what the model file holds of them.
std::vector<Prior> known_about_torque(const TransducerAccuracy& accuracy,
                                      const SharedVector<double>& shared) {
  const std::size_t gain = entry_named("torque_sensor", "gain"),
                    zero = entry_named("torque_sensor", "offset_Nm");
  return {{gain, shared[gain], accuracy.gain}, {zero, shared[zero], accuracy.zero_Nm}};
}

Parameter parameter_of(const WorkingModel& working, std::size_t entry, const char* unit) {
  Parameter p;
  p.value = working.at.shared[entry];
  p.unit = unit;
  const double sigma = working.sigma(entry);
  if (std::isfinite(sigma)) {
    p.ci95_low = p.value - kNormal975 * sigma;
    p.ci95_high = p.value + kNormal975 * sigma;
    p.found = "global fit";
  } else if (const std::string caveat = working.fit.caveat(entry); !caveat.empty()) {
    p.found = "global fit: " + caveat;
  }
  return p;
}

}  // namespace

std::string name_of(const Candidate& candidate) { return kEffectInfos[candidate.effect].name; }
const EffectForm& form_of(const Candidate& candidate) {
  return kEffectInfos[candidate.effect].forms[candidate.form];
}

bool needs_torque(const Candidate& candidate) {
  return kEffectInfos[candidate.effect].needs == Needs::kTorque;
}

bool any_needs_torque(const std::vector<Candidate>& candidates) {
  return std::any_of(candidates.begin(), candidates.end(), needs_torque);
}

std::vector<std::size_t> shared_entries(const Candidate& candidate) {
  std::vector<std::size_t> out;
  for (const std::size_t k : form_of(candidate).shared) out.push_back(kSharedPlace[candidate.effect] + k);
  return out;
}

std::vector<std::size_t> local_entries(const Candidate& candidate) {
  std::vector<std::size_t> out;
  static const std::size_t corner = entry_named("rotor_skin_effect", "corner_rad_s");
  for (const std::size_t entry : shared_entries(candidate)) {
    if (entry == corner) out = {4, 5};
  }
  if (!form_of(candidate).local) return out;
  for (std::size_t e = kLocalPlace[candidate.effect]; e < kLocalPlace[candidate.effect + 1]; ++e)
    out.push_back(e);
  return out;
}

Freedom WorkingModel::freedom() const {
  Freedom free{{0, 1, 2, 3}, {0, 1, 2, 3}, base_reach};
  for (const Candidate& c : active) {
    const auto shared = shared_entries(c), local = local_entries(c);
    free.shared.insert(free.shared.end(), shared.begin(), shared.end());
    free.local.insert(free.local.end(), local.begin(), local.end());
  }
  for (const std::size_t e : nuisances) {
    if (!has(effect_of_shared(e))) free.shared.push_back(e);
  }
  free.local.insert(free.local.end(), local_nuisances.begin(), local_nuisances.end());
  return free;
}

std::vector<Prior> WorkingModel::live_priors() const {
  // What a DC test tells of R_s is another thing where the inverter keeps a part of the voltage, where the
  // phases differ, since it fed some of them, and where the winding heats up from nobody knows what.
  static const std::size_t drop = *effect_number("inverter_dead_time"),
                           unbalance = *effect_number("stator_unbalance");
  const bool spoiled = has(drop) || has(unbalance) || (!R_s_has_temperature && R_s_follows_temperature());
  std::vector<Prior> out = priors;
  std::erase_if(out, [&](const Prior& p) {
    return p.entry < kBase ? spoiled && p.entry == 0 : has(effect_of_shared(p.entry));
  });
  return out;
}

double WorkingModel::gain_sigma() const {
  // A parameter of an effect that is active.
  const auto found = [this](const char* effect, const char* parameter) {
    return has(*effect_number(effect)) ? at.shared[entry_named(effect, parameter)] : 0.0;
  };
  // Gains a, b, -(a + b) about their mean; a negative sequence.
  const double a = found("current_gain", "phase_a"), b = found("current_gain", "phase_b");
  const double real = found("supply_unbalance", "real"), imaginary = found("supply_unbalance", "imaginary");
  return std::sqrt(common_gain * common_gain + (a * a + b * b + a * b) / 3.0 + real * real +
                   imaginary * imaginary);
}

double WorkingModel::sigma(std::size_t entry) const {
  const std::string_view unit = entry < kBase ? "ohm" : shared_parameter(entry).unit;
  const bool impedance = unit.starts_with("ohm") || unit.starts_with("S");
  return std::hypot(fit.sigma(entry), unseen_sigma(entry), impedance ? gain_sigma() * at.shared[entry] : 0.0);
}

double WorkingModel::unseen_sigma(std::size_t entry) const {
  const auto m = static_cast<std::size_t>(std::find(fit.free.shared.begin(), fit.free.shared.end(), entry) -
                                          fit.free.shared.begin());
  return m < unseen.size() ? unseen[m] : 0.0;
}

bool WorkingModel::has(std::size_t effect) const {
  return std::any_of(active.begin(), active.end(), [&](const Candidate& c) { return c.effect == effect; });
}

bool WorkingModel::R_s_follows_temperature() const {
  static const std::size_t heating = *effect_number("stator_heating");
  return std::any_of(active.begin(), active.end(),
                     [](const Candidate& c) { return c.effect == heating && !form_of(c).local; });
}

void fill_references(const GlobalProblem& problem, SharedVector<double>& shared) {
  shared[entry_named("magnetizing_saturation", "psi_ref_Wb")] = problem.largest_flux_Wb();
  if (problem.has_stator_C()) {
    shared[entry_named("rotor_heating", "reference_C")] = problem.mean_stator_C();
    shared[entry_named("stator_heating", "reference_C")] = problem.mean_stator_C();
  }
  shared[entry_named("leakage_saturation", "psi_ref_Wb")] = problem.largest_current_A() * shared[2];
}

// The library's figures are those of a motor of a few kilowatts: 20 A, 0.2 ohm, 0.45 Wb, 20 Nm.
double material_size(const GlobalProblem& problem, const SharedVector<double>& shared, std::size_t entry) {
  const EffectParameter& p = shared_parameter(entry);
  const std::string_view unit = p.unit;
  const double current = problem.largest_current_A() / 20.0, flux = problem.largest_flux_Wb() / 0.45;
  if (unit == "A") return p.scale * current;
  if (unit == "ohm s") return p.scale * shared[1] / 0.2;
  if (unit == "V") return p.scale * std::max(0.1, shared[0] * current / 0.4);
  if (unit == "S" || unit == "S rad/s") return p.scale * current / flux;
  const double torque =
      problem.largest_torque_Nm() > 0.0 ? problem.largest_torque_Nm() / 20.0 : current * flux;
  if (unit == "Nm" || unit == "Nm s" || unit == "Nm s^2") return p.scale * torque;
  if (unit == "Nm/A^2") return p.scale * torque / (current * current);
  return p.scale;
}

std::vector<Candidate> active_effects(const Model& model) {
  std::vector<Candidate> out;
  for (const ActiveEffect& effect : model.effects) {
    const auto number = effect_number(effect.name);
    if (!number)
      throw Error("model \"" + model.name + "\"", "has the effect \"" + effect.name + "\"",
                  "imrig model effects lists those there are");
    if (kEffectInfos[*number].correction)
      throw Error("model \"" + model.name + "\"", "has " + effect.name + " among its effects",
                  "it is the error of a sensor: [[correction]] holds it where it is known");
    out.push_back({*number, form_number(effect, *number)});
  }
  return out;
}

WorkingModel working_model(const GlobalProblem& problem, const Model& model) {
  WorkingModel out;
  SharedVector<double> shared = shared_vector(model);
  SharedVector<double> referred = shared;
  fill_references(problem, referred);
  for (std::size_t k = 0; k < kEffects; ++k) {
    const bool active = std::any_of(model.effects.begin(), model.effects.end(),
                                    [&](const auto& e) { return e.name == kEffectInfos[k].name; });
    for (std::size_t e = kSharedPlace[k]; e < kSharedPlace[k + 1]; ++e) {
      if (!active) shared[e] = referred[e];
    }
  }
  out.active = active_effects(model);
  const bool of_dc_test = model.R_s.found.starts_with("dc test") && std::isfinite(model.R_s.ci95_high);
  out.R_s_has_temperature = std::isfinite(model.R_s_stator_C);
  const std::size_t heating = *effect_number("stator_heating");
  if (of_dc_test && out.R_s_has_temperature && !out.has(heating))
    shared[entry_named("stator_heating", "reference_C")] = model.R_s_stator_C;
  out.at = problem.start(shared);
  if (of_dc_test) {
    const double sigma = 0.5 * (model.R_s.ci95_high - model.R_s.ci95_low) / kNormal975;
    out.priors.push_back({0, model.R_s.value, std::max(sigma, 1e-4 * model.R_s.value)});
  }
  const Accuracy& accuracy = problem.data().accuracy;
  // Three independent errors of a channel have a mean of sigma/sqrt(3).
  out.common_gain = std::hypot(accuracy.current_gain, accuracy.voltage_gain) / std::sqrt(3.0);
  if (problem.speed_sigma() > 0.0) out.local_nuisances.push_back(kLocalPlace[*effect_number("speed_bias")]);
  admit("supply_unbalance", accuracy.voltage_gain / std::sqrt(6.0), out);
  admit("voltage_lag", kLagShare * problem.sample_time_s(), out);
  admit("current_offset", kOffsetShare * problem.largest_current_A(), out);
  admit("current_gain", accuracy.current_gain * std::sqrt(2.0 / 3.0), out);
  if (problem.has_torque_of_series())
    out.considered = known_about_torque(problem.transducer(), out.at.shared);
  return out;
}

void keep_in_reach(const Model& model, WorkingModel& working) {
  for (std::size_t k = 0; k < kBase; ++k) {
    const Parameter& came = model.*base_parameters()[k].place;
    // The inverter's drop on commanded voltages makes a DC test see many times R_s.
    const bool sure = std::isfinite(came.ci95_high) && !came.found.starts_with("dc test");
    const double reach = sure || is_start(came) ? kReach : kReachOfGuess;
    if (came.value > 0.0) working.base_reach[k] = {came.value / reach, came.value * reach};
  }
}

std::vector<std::string> at_the_end_of_reach(const WorkingModel& working) {
  std::vector<std::string> out;
  for (std::size_t k = 0; k < kBase; ++k) {
    const double x = working.at.shared[k];
    if (x <= working.base_reach[k].low || x >= working.base_reach[k].high)
      out.push_back(base_parameters()[k].name);
  }
  return out;
}

Model to_model(const Model& before, const WorkingModel& working) {
  Model model = before;
  for (std::size_t k = 0; k < kBase; ++k) {
    const BaseParameter& base = base_parameters()[k];
    const std::string found = (model.*base.place).found;
    model.*base.place = parameter_of(working, k, base.unit);
    if (k == 0 && !working.priors.empty() && working.priors.front().entry == 0)
      (model.*base.place).found = found;
  }
  if (working.R_s_follows_temperature())
    model.R_s_stator_C = working.at.shared[entry_named("stator_heating", "reference_C")];
  model.effects.clear();
  // What is followed is written anew; what is known stays.
  const std::vector<ActiveEffect> known = model.corrections;
  std::erase_if(model.corrections, [&](const ActiveEffect& c) {
    return std::any_of(working.nuisances.begin(), working.nuisances.end(),
                       [&](std::size_t e) { return kEffectInfos[effect_of_shared(e)].name == c.name; });
  });
  for (const std::size_t e : working.nuisances) {
    const std::size_t number = effect_of_shared(e);
    if (working.has(number)) continue;
    if (model.corrections.empty() || model.corrections.back().name != kEffectInfos[number].name) {
      const auto same = std::find_if(known.begin(), known.end(),
                                     [&](const auto& c) { return c.name == kEffectInfos[number].name; });
      model.corrections.push_back(same != known.end() ? *same
                                                      : ActiveEffect{kEffectInfos[number].name, "", {}});
    }
    const EffectParameter& p = shared_parameter(e);
    model.corrections.back().parameters[p.name] = parameter_of(working, e, p.unit);
  }
  for (const Candidate& c : working.active) {
    ActiveEffect effect;
    effect.name = name_of(c);
    effect.form = form_of(c).name;
    for (std::size_t e = kSharedPlace[c.effect]; e < kSharedPlace[c.effect + 1]; ++e) {
      const EffectParameter& p = shared_parameter(e);
      const bool free = std::isfinite(working.fit.sigma(e));
      if (p.role == Role::kAmplitude && !free && working.at.shared[e] == p.neutral) continue;
      effect.parameters[p.name] = parameter_of(working, e, p.unit);
    }
    model.effects.push_back(std::move(effect));
  }
  return model;
}

}  // namespace imrig::est
