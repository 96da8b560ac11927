#pragma once
// A model's parameters in another equivalent circuit (convert.h), with intervals carried over by first order
// as if the four base parameters' errors were independent: f's half width is the root of sum (df/dtheta_k
// h_k)^2. A quantity that depends on a parameter without an interval has none. These are the parameters at
// neutral effects.

#include <optional>
#include <string>
#include <vector>

#include "estimators/model/model.h"

namespace imrig::est {

enum class Circuit { kTCircuit, kGammaCircuit, kInverseGammaCircuit };

// "t", "gamma", "inverse-gamma".
std::optional<Circuit> circuit_from(const std::string& word);

struct CircuitParameter {
  std::string name;  // R_s, L_ls, ...
  std::string meaning;
  Parameter parameter;
};

// L_s/L_r as saturation has shown it: of leakage that saturates on both sides (t_circuit.h), else nothing. A
// linear motor does not show it at its terminals.
std::optional<double> seen_ratio(const Model& model);

// Per phase of the equivalent star. L_s_over_L_r: of the T circuit alone. Throws Error when a base parameter
// is not known, or the ratio makes a leakage negative.
std::vector<CircuitParameter> parameters_in(const Model& model, Circuit circuit, double L_s_over_L_r = 1.0);

}  // namespace imrig::est
