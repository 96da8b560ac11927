#pragma once
// The rig's menu of experiments, inside its limits, as records that may be simulated before anybody takes
// them:
//   locked-like frequency sweep at low current (a turning field too weak to turn the shaft)
//   locked-like sweeps of frequency and of current, and a slow one near DC, along one axis (no torque)
//   no-load sweeps of voltage and of frequency, grid of flux and load, steps over frequency and load
//   some of them twice, cold and hot
// A coast-down is not on it: the gates are off, so the current says nothing of the model.

#include <string>
#include <vector>

#include "estimators/fit/global/global_problem.h"
#include "estimators/model/model.h"
#include "rig/base/rig_config.h"

namespace imrig::est {

// What an experiment may use.
struct RigRange {
  double current_A = 0.0;    // peak, transients included
  double voltage_V = 0.0;    // peak phase voltage, the step included
  double speed_rad_s = 0.0;  // synchronous, mechanical
  double rated_V = 0.0;      // peak phase voltage that a plan calls 100 %
  double rated_Hz = 0.0;
  double friction_Nm = kMissing;  // at rated speed; NaN: not known
  bool from_rig = false;
};

RigRange range_of(const RigConfig& rig);  // with the margins that a campaign keeps
// What the data themselves have seen; 100 % is the model's rating, else the largest voltage in the data.
RigRange range_of(const GlobalProblem& problem, const Model& model);

// One record of an experiment. Voltages by the circuit that was handed to menu().
struct PlannedRecord {
  RecordKind kind = RecordKind::kStep;  // step, steady, no_load or locked_sweep
  double f_Hz = 0.0, v_peak_V = 0.0;
  double slip = 0.0;                      // per unit; 1 at rest
  double load_share = 0.0;                // of the most that the point can carry
  double step = 0.0;                      // relative, of the voltage
  double current_A = 0.0;                 // locked_sweep, peak
  bool axis = false;                      // locked_sweep: along one axis
  double heat = 0.5;                      // 0 cold, 1 hot
  double before_s = 0.0, record_s = 0.5;  // as planned
  double simulated_s = 0.2;               // so much of it; what more of the same tells is less noise
};

struct Experiment {
  std::string name;  // in plain words
  std::vector<PlannedRecord> records;
  bool cold_and_hot = false;  // the second half repeats the first on a hot motor
};

// Only records that the range allows; an experiment of fewer than three is left out. From quick to laborious.
std::vector<Experiment> menu(const RigRange& range, const MachineParameters<double>& motor, int pole_pairs);

}  // namespace imrig::est
