#pragma once
// Validation as published (Proca and Keyhani 2002, section VIII): the full model, with mapped parameters, and the
// model with constant rated parameters, both driven by the measured voltage and speed.
//   input power  at every steady window: figure 13
//   steps        currents in the synchronous frame around a voltage step: figures 14 to 16
//   starts       from zero flux, the gates' first instant on: figures 17 and 18
// Records are judged whether they were fitted or held out; held-out ones say so.

#include <complex>
#include <optional>
#include <string>
#include <vector>

#include "estimators/fit/maps/parameter_maps.h"

namespace imrig::est {

struct PowerCheck {
  std::string id;
  bool holdout = false;
  double f_Hz = 0.0, v_V = 0.0, slip = 0.0;
  double measured_W = 0.0, full_W = 0.0, rated_W = 0.0;  // rated: constant parameters
};

// At most kShown samples, synchronous frame of the supply.
struct TransientCheck {
  std::string id;
  bool holdout = false;
  double f_Hz = 0.0;
  double full_nrmse = kMissing, rated_nrmse = kMissing;  // rms of the current's error over its rms
  std::vector<double> t_s;
  std::vector<std::complex<double>> measured, full, rated;
};

struct Validation {
  MachineParameters<double> constants;  // of the constant model
  std::string constants_from;
  std::vector<std::string> notes;
  std::vector<PowerCheck> powers;
  std::vector<TransientCheck> steps;   // all step records; the shown samples of the worst few and the large ones
  std::vector<TransientCheck> starts;
  double rated_W = kMissing;           // what errors of power are related to: the largest measured input
  double worst_full = kMissing, rms_full = kMissing;    // of rated_W
  double worst_rated = kMissing, rms_rated = kMissing;
  std::size_t held_out = 0;            // of the windows: in records that no fit saw
  double worst_held_out = kMissing, rms_held_out = kMissing;
};

// The circuit of the steady window with the largest input power, as a test at rated load would give it: warm, saturated.
// R_s: where the maps have no line over temperature. Nothing where no window tells all of it.
std::optional<MachineParameters<double>> circuit_at_largest_power(const ParameterMaps& maps, double R_s);

// constants: rated parameters, from where.
Validation validate(const DataSet& data, const ParameterMaps& maps, const MachineParameters<double>& constants,
                    const std::string& from);

}  // namespace imrig::est
