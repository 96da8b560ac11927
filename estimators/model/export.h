#pragma once
// A model as drives and other programs want it: numbers and tables with the unit in every name.
//   parameters   the inverse-gamma circuit (the one of rotor-flux orientation: L_l is the transient
//   inductance sigma L_s), T with
//                L_s = L_r, gamma, with intervals
//   drive        rotor time constant L_m/R_r, sigma, torque per (rotor flux times i_q) = (3/2) n_p, and at
//   the rated point (where
//                the ratings tell voltage, frequency and speed) rotor flux, i_d, i_q: base circuit, active
//                saturation in i_d
//   tables       magnetizing and leakage curves (magnetic_tables.h) to 130 % of the rated flux and twice the
//   rated current
// All values per phase of the equivalent star, amplitude-invariant, peak.

#include <string>
#include <vector>

#include "estimators/model/model.h"

namespace imrig::est {

struct ExportedNumber {
  std::string name;  // R_s_ohm, T_L_m_H, rotor_time_constant_s, ...
  double value = kMissing;
  double ci95_low = kMissing, ci95_high = kMissing;
  std::string meaning;
};

struct ExportedTable {
  std::string name;
  std::string meaning;
  std::vector<std::string> columns;       // with units
  std::vector<std::vector<double>> rows;  // as many numbers as columns
};

struct ExportedModel {
  std::string name;
  int pole_pairs = 0;
  bool delta = false;
  std::vector<ExportedNumber> numbers;
  std::vector<ExportedTable> tables;
};

// Throws Error when a base parameter is not known.
ExportedModel exported(const Model& model);

// name,value,ci95_low,ci95_high,meaning; then each table under its own header line, an empty line between
// them.
std::string exported_csv(const ExportedModel& model);
// {"version":1,"name","pole_pairs","connection","numbers":{name:{"value","ci95","meaning"}},"tables":{name:{"meaning","columns":{column:[..]}}}}
std::string exported_json(const ExportedModel& model);
// C99: MOTOR_... macros, tables as static const double arrays, nothing but the language itself needed.
std::string exported_c(const ExportedModel& model);

}  // namespace imrig::est
