#include "estimators/model/convert_model.h"

#include <array>
#include <cmath>
#include <functional>

#include "estimators/model/convert.h"

namespace imrig::est {

namespace {

using Machine = MachineParameters<double>;
using Function = std::function<double(const Machine&)>;

struct Entry {
  const char* name;
  const char* unit;
  const char* meaning;
  Function of;
};

std::vector<Entry> t_entries(double ratio) {
  return {
      {"R_s", "ohm", "stator resistance", [](const Machine& p) { return p.R_s; }},
      {"R_r", "ohm", "rotor resistance", [=](const Machine& p) { return t_of(p, ratio).R_r; }},
      {"L_ls", "H", "stator leakage", [=](const Machine& p) { return t_of(p, ratio).L_ls; }},
      {"L_lr", "H", "rotor leakage", [=](const Machine& p) { return t_of(p, ratio).L_lr; }},
      {"L_m", "H", "magnetizing inductance", [=](const Machine& p) { return t_of(p, ratio).L_m; }},
      {"L_s", "H", "stator inductance L_ls + L_m", [](const Machine& p) { return p.L_l + p.L_m; }},
      {"L_r", "H", "rotor inductance L_lr + L_m", [=](const Machine& p) { return (p.L_l + p.L_m) / ratio; }}};
}

std::vector<Entry> gamma_entries() {
  return {{"R_s", "ohm", "stator resistance", [](const Machine& p) { return p.R_s; }},
          {"R_R", "ohm", "rotor resistance", [](const Machine& p) { return gamma_of(p).R_r; }},
          {"L_L", "H", "leakage, on the rotor side", [](const Machine& p) { return gamma_of(p).L_L; }},
          {"L_M", "H", "magnetizing inductance, carries the stator flux",
           [](const Machine& p) { return gamma_of(p).L_M; }}};
}

std::vector<Entry> inverse_gamma_entries() {
  return {
      {"R_s", "ohm", "stator resistance", [](const Machine& p) { return p.R_s; }},
      {"R_r", "ohm", "rotor resistance", [](const Machine& p) { return p.R_r; }},
      {"L_l", "H", "leakage, on the stator side", [](const Machine& p) { return p.L_l; }},
      {"L_m", "H", "magnetizing inductance, carries the rotor flux", [](const Machine& p) { return p.L_m; }}};
}

double& entry_of(Machine& p, std::size_t k) {
  const std::array<double*, 4> places{&p.R_s, &p.R_r, &p.L_l, &p.L_m};
  return *places[k];
}

// Central difference over a part in 10^4, far from where a leakage would change its sign.
double slope(const Function& f, const Machine& p, std::size_t k) {
  Machine more = p, less = p;
  const double step = 1e-4 * entry_of(more, k);
  entry_of(more, k) += step;
  entry_of(less, k) -= step;
  return (f(more) - f(less)) / (2.0 * step);
}

// Ends of the interval, each from the ends of the base parameters on that side.
void carry_interval(const Model& model, const Machine& p, const Function& f, Parameter& out) {
  double below = 0.0, above = 0.0;
  for (std::size_t k = 0; k < 4; ++k) {
    const Parameter& base = model.*base_parameters()[k].place;
    const double d = slope(f, p, k);
    if (std::abs(d) * base.value < 1e-9 * std::abs(out.value)) continue;
    if (is_start(base)) out.found = base.found;
    const double up = base.ci95_high - base.value, down = base.value - base.ci95_low;
    above += std::pow(d * (d > 0.0 ? up : down), 2);
    below += std::pow(d * (d > 0.0 ? down : up), 2);
  }
  out.ci95_low = out.value - std::sqrt(below);
  out.ci95_high = out.value + std::sqrt(above);
}

}  // namespace

std::optional<Circuit> circuit_from(const std::string& word) {
  if (word == "t") return Circuit::kTCircuit;
  if (word == "gamma") return Circuit::kGammaCircuit;
  if (word == "inverse-gamma") return Circuit::kInverseGammaCircuit;
  return std::nullopt;
}

std::optional<double> seen_ratio(const Model& model) {
  for (const ActiveEffect& effect : model.effects) {
    if (effect.name != "leakage_saturation") continue;
    const auto found = effect.parameters.find("rotor_share");
    if (found == effect.parameters.end()) continue;
    const double share = found->second.value;
    if (!(share > 0.0 && share < 1.0)) continue;
    const Machine p = model.machine();
    const double M = p.L_m + share * p.L_l;  // L_s = L_m + L_l, L_r = M^2/L_m
    return (p.L_m + p.L_l) * p.L_m / (M * M);
  }
  return std::nullopt;
}

std::vector<CircuitParameter> parameters_in(const Model& model, Circuit circuit, double L_s_over_L_r) {
  const Machine p = model.machine();
  const auto entries = circuit == Circuit::kTCircuit       ? t_entries(L_s_over_L_r)
                       : circuit == Circuit::kGammaCircuit ? gamma_entries()
                                                           : inverse_gamma_entries();
  std::vector<CircuitParameter> out;
  for (const Entry& entry : entries) {
    CircuitParameter one{entry.name, entry.meaning, {}};
    one.parameter.value = entry.of(p);
    one.parameter.unit = entry.unit;
    if (circuit == Circuit::kInverseGammaCircuit) {
      one.parameter = model.*base_parameters()[out.size()].place;
      one.parameter.unit = entry.unit;
    } else {
      carry_interval(model, p, entry.of, one.parameter);
    }
    out.push_back(one);
  }
  return out;
}

}  // namespace imrig::est
