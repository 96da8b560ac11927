#pragma once
// A fitted motor model: base parameters of the inverse-gamma circuit (per phase of the equivalent star) with
// their intervals, ratings, active effects, and the history of how it came about. Stored as TOML:
// model_file.h, docs/model-file.md.

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "estimators/model/base_machine.h"
#include "rig/base/rig_config.h"
#include "rig/data/record.h"

namespace imrig::est {

inline constexpr int kModelFileVersion = 1;
inline constexpr const char* kInverseGamma = "inverse-gamma";

struct Parameter {
  double value = kMissing;
  double ci95_low = kMissing;  // NaN: nothing is known about the uncertainty
  double ci95_high = kMissing;
  std::string unit;   // "ohm", "H", ...
  std::string found;  // how it was found, one clause: "dc test, 3 records"; "nominal"
  bool known() const { return value == value; }
};

// `found` of a value that the data left open: somewhere to start from, no result, without interval.
inline constexpr const char* kRoughStart = "rough start, no result";
inline bool is_start(const Parameter& p) { return p.found.starts_with(kRoughStart); }

// Name plate; 0 where unknown. Line quantities, rms.
struct Ratings {
  double voltage_V = 0.0;
  double frequency_Hz = 0.0;
  double current_A = 0.0;
  double speed_rpm = 0.0;
  double power_W = 0.0;
};

// An active effect with its parameters by name. The library of effects gives the names their meaning.
struct ActiveEffect {
  std::string name;
  std::string form;  // one of those the effect has; empty: its plainest
  std::map<std::string, Parameter> parameters;
};

// A parameter mapped to operating conditions; map_forms.h says which there are and what their parameters mean.
struct ParameterMap {
  std::string name;
  std::map<std::string, Parameter> parameters;
};

// One step of the model's history.
struct Revision {
  int number = 0;
  std::string change;  // "identified", "added rotor_skin_effect", ...
  std::string data;    // name of the data set
  std::uint64_t data_hash = 0;
  double fitted_nrmse = kMissing;
  double holdout_nrmse = kMissing;
  double floor_nrmse = kMissing;
};

struct Model {
  std::string name = "motor";
  int pole_pairs = 0;
  bool delta = false;  // the motor's connection; the parameters are star-equivalent all the same
  Ratings ratings;
  std::string circuit = kInverseGamma;
  Parameter R_s, R_r, L_l, L_m;
  double R_s_stator_C = kMissing;  // winding temperature that R_s belongs to
  std::vector<ActiveEffect> effects;
  std::vector<ActiveEffect> corrections;  // of the sensors, inside their declared accuracy: no physics
  std::vector<ParameterMap> maps;  // beside the base parameters, not instead of them
  std::vector<Revision> history;

  // The four base values. Throws Error when one is not known.
  MachineParameters<double> machine() const;
};

// Names, units and places of the base parameters, in the order R_s, R_r, L_l, L_m.
struct BaseParameter {
  const char* name;
  const char* unit;
  Parameter Model::*place;
};
const std::array<BaseParameter, 4>& base_parameters();

// A model that holds what the rig's configuration says about its motor; every parameter "nominal", without
// interval.
Model nominal_model(const MotorConfig& motor);

}  // namespace imrig::est
