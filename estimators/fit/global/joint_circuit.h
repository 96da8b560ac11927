#pragma once
// The four parameters of the base circuit from all records together, with no circuit known beforehand: fits
// from several rough circuits (rough_circuits.h) to a part of the records, the best two to all, the lowest
// chi2 wins. Records one by one need steps or several slips to tell the parameters apart; together, steady
// records, tables and whatever else there is tell them without.
//
// A parameter whose 95 % interval is wider than itself is left open by the data. It stays at the rough
// circuit (taken as good to a half), the others are fitted to it, and its uncertainty goes into theirs.

#include <array>
#include <string>
#include <vector>

#include "estimators/model/base_machine.h"
#include "rig/data/record.h"

namespace imrig::est {

// What is known of a parameter beforehand.
struct Told {
  double value = kMissing;  // NaN: nothing
  double sigma = kMissing;  // NaN: not known
  bool held = false;        // else the value pulls with its sigma
};

// Arrays in the order R_s, R_r, L_l, L_m.
struct JointCircuit {
  std::array<double, 4> value{};
  std::array<double, 4>
      sigma{};  // from record to record, with that of held and open ones; of a held one as told; NaN: open
  std::array<bool, 4> open{};        // left open by these data: a start and no result
  double times_noise = kMissing;     // root of chi2 a value
  double nrmse = kMissing;           // current, error over signal
  std::vector<std::size_t> records;  // of the data set that were fitted
  std::string failure;               // why nothing of it is a result; empty: it is one
};

// Throws Error: no record that can be simulated, or hold-outs only.
JointCircuit joint_circuit(const DataSet& data, const std::array<Told, 4>& told, int threads);

}  // namespace imrig::est
