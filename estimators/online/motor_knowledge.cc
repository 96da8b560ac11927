#include "estimators/online/motor_knowledge.h"

#include <algorithm>
#include <cmath>

#include "estimators/model/effects/registry.h"
#include "rig/base/error.h"

namespace imrig::est {

namespace {

constexpr double kReference_C = 25.0;
constexpr double kCopper_C = 234.5, kAluminium_C = 225.0;
constexpr double kWidth95 = 2.0 * 1.959964;

double relative_sigma(const Parameter& p) {
  const double width = p.ci95_high - p.ci95_low;
  return width >= 0.0 && p.value > 0.0 ? width / (kWidth95 * p.value) : kNominalSigma;
}

template <class List>
const auto* named(const List& list, const char* name) {
  const auto found = std::find_if(list.begin(), list.end(), [&](const auto& e) { return e.name == name; });
  return found == list.end() ? nullptr : &*found;
}

template <class Holder>
double parameter_or(const Holder* holder, const char* name, double fallback) {
  if (holder == nullptr) return fallback;
  const auto found = holder->parameters.find(name);
  return found != holder->parameters.end() && found->second.known() ? found->second.value : fallback;
}

void take_stator(const Model& model, MotorKnowledge& k) {
  k.R_s_reference_C = std::isnan(model.R_s_stator_C) ? kReference_C : model.R_s_stator_C;
  k.R_s_per_K = 1.0 / (kCopper_C + k.R_s_reference_C);
  if (const auto* heating = named(model.effects, "stator_heating")) {
    k.R_s_reference_C = parameter_or(heating, "reference_C", k.R_s_reference_C);
    k.R_s_per_K = parameter_or(heating, "per_K", k.R_s_per_K);
  }
  if (const auto* map = named(model.maps, "R_s")) {
    const double alpha = parameter_or(map, "alpha", kMissing), R_20 = parameter_or(map, "R_20", kMissing);
    if (alpha > 0.0 && R_20 > 0.0) {
      k.base.R_s = R_20;
      k.R_s_reference_C = 20.0;
      k.R_s_per_K = alpha;
    }
  }
}

void take_rotor(const Model& model, MotorKnowledge& k) {
  k.R_1_ohm = k.base.R_r;
  k.R_1_reference_C = kReference_C;
  k.R_1_per_K = 1.0 / (kAluminium_C + kReference_C);
  if (const auto* heating = named(model.effects, "rotor_heating")) {
    const double per_K = parameter_or(heating, "per_K", 0.0);
    k.R_1_reference_C = parameter_or(heating, "reference_C", kReference_C);
    if (per_K > 0.0) k.R_1_per_K = per_K;
  }
  if (const auto* skin = named(model.effects, "rotor_skin_effect")) {
    k.k_6_ohm_s = parameter_or(skin, "k6_ohm_s", 0.0);
    const auto found = skin->parameters.find("k6_ohm_s");
    if (found != skin->parameters.end()) k.k_6_sigma = relative_sigma(found->second) * k.k_6_ohm_s;
  }
  if (const auto* map = named(model.maps, "R_r")) {
    k.R_1_ohm = parameter_or(map, "R_1", k.R_1_ohm);
    k.k_6_ohm_s = parameter_or(map, "k_6", k.k_6_ohm_s);
    k.R_1_reference_C = parameter_or(map, "reference", k.R_1_reference_C);
    const double per_K = parameter_or(map, "per_K", 0.0);
    if (per_K > 0.0) k.R_1_per_K = per_K;
    const auto found = map->parameters.find("k_6");
    if (found != map->parameters.end()) k.k_6_sigma = relative_sigma(found->second) * k.k_6_ohm_s;
  }
}

void take_iron(const Model& model, MotorKnowledge& k) {
  if (const auto* loss = named(model.effects, "core_loss")) {
    k.eddy_S = parameter_or(loss, "eddy_S", 0.0);
    k.hysteresis_S_rad_s = parameter_or(loss, "hysteresis_S_rad_s", 0.0);
    k.iron_place = parameter_or(loss, "place", 0.5);
  }
  if (const auto* s = named(model.effects, "magnetizing_saturation")) {
    k.saturation = {parameter_or(s, "extra", 0.0),      parameter_or(s, "exponent", 6.0),
                    parameter_or(s, "place", 0.5),      parameter_or(s, "bend", 0.0),
                    parameter_or(s, "psi_ref_Wb", 0.5), parameter_or(s, "onset", 0.0)};
  }
}

}  // namespace

double MotorKnowledge::R_s_ohm(double stator_C) const {
  return std::isnan(stator_C) ? base.R_s : base.R_s * (1.0 + R_s_per_K * (stator_C - R_s_reference_C));
}

double MotorKnowledge::stator_C(double R_s_ohm) const {
  return R_s_reference_C + (R_s_ohm / base.R_s - 1.0) / R_s_per_K;
}

double MotorKnowledge::rotor_C(double R_1) const {
  return R_1_reference_C + (R_1 / R_1_ohm - 1.0) / R_1_per_K;
}

double MotorKnowledge::iron_S(double w_e) const {
  return eddy_S + hysteresis_S_rad_s / std::max(std::abs(w_e), 6.0);
}

RotorCircuit MotorKnowledge::circuit(double R_s, double R_r_near, double w_e) const {
  RotorCircuit c;
  c.R_s_ohm = R_s;
  c.L_m_H = base.L_m;
  c.L_l_H = base.L_l;
  const double iron = iron_S(w_e);
  c.R_c_ohm = iron * iron_place > 0.0 ? 1.0 / (iron * iron_place) : 0.0;
  c.stator_iron_S = iron * (1.0 - iron_place);
  c.R_r_near_ohm = R_r_near;
  c.saturation = saturation;
  return c;
}

MotorKnowledge knowledge_of(const Model& model) {
  MotorKnowledge k;
  k.pole_pairs = model.pole_pairs;
  k.base = model.machine();
  k.sigma = {relative_sigma(model.R_s), relative_sigma(model.R_r), relative_sigma(model.L_l), relative_sigma(model.L_m)};
  k.shared = shared_vector(model);
  k.has_effects = !model.effects.empty();
  take_stator(model, k);
  take_rotor(model, k);
  take_iron(model, k);
  return k;
}

}  // namespace imrig::est
