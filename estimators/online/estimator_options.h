#pragma once
// Command line of imrig-estimator, and the core's configuration from it, the rig's file and the model.

#include <optional>
#include <string>

#include "estimators/online/estimator.h"
#include "rig/base/rig_config.h"

namespace CLI {
class App;
}

namespace imrig::est {

struct EstimatorOptions {
  std::string config = "rig.toml";
  std::string model;     // empty: the rig's nominal motor
  std::string url;       // before the configuration's; file://LOG?speed=N reads a log, 0: as fast as it can
  std::string out;       // event log that keeps what is published
  double elsewhere_rad_s = 0.0;  // 0: rated slip
  double least_slip = 0.02;
  bool no_joint = false;
  std::optional<int> realtime;  // SCHED_FIFO priority
  bool lock_memory = false;
};

void add_options(CLI::App& app, EstimatorOptions& options);
// Throws Error: bad model, pole pairs that differ from the rig's.
EstimatorConfig estimator_config(const EstimatorOptions& options, const RigConfig& rig);

}  // namespace imrig::est
